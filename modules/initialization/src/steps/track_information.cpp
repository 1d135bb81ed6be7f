#include "etalon/initialization/steps/track_information.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "etalon/core/inverse_root.h"
#include "etalon/core/so3.h"
#include "etalon/core/statistics.h"
#include "etalon/optimization/bundle/reduced_information.h"

namespace etalon {

using Eigen::Index;
using Eigen::Matrix3d;
using Eigen::Vector2d;
using Eigen::Vector3d;
using Matrix23 = Eigen::Matrix<double, 2, 3>;

namespace {

constexpr int kCameras = 2;
constexpr double kAtRest = 1e-2;  // squared step of a landmark in standard deviations
constexpr double kBehind = 1e12;  // squared residual of a landmark that no camera can see

/**
 * Expectations of the weight w = (c^2 / (c^2 + r^2))^2 over residuals of two standard normal
 * coordinates, r^2 / 2 being exponentially distributed: of w; of the score's derivative; of the
 * score's variance (Huber and Ronchetti, Robust Statistics, chapter 6).
 */
struct KernelMoments {
  double weight = 0.0, derivative = 0.0, variance = 0.0;

  explicit KernelMoments(double c2) {
    constexpr int kIntervals = 400;  // of Simpson's rule on r^2 / 2 from 0 to 40
    constexpr double kStep = 0.1;
    double mass = 0.0;
    for (int i = 0; i <= kIntervals; ++i) {
      const double half = kStep * i, times = i % kIntervals == 0 ? 1.0 : i % 2 == 1 ? 4.0 : 2.0;
      const double density = times * std::exp(-half);
      const double share = c2 / (c2 + 2.0 * half), w = share * share;
      mass += density;
      weight += density * w;
      derivative += density * w * (1.0 - 2.0 * (1.0 - share));
      variance += density * w * w * half;
    }
    weight /= mass;
    derivative /= mass;
    variance /= mass;
  }
};

/** Variance of a coordinate as squared residuals of two show it, `unknowns` having been fitted. */
double noiseVariance(const std::vector<double>& r2, double median, double unknowns) {
  const double all = 2.0 * r2.size();
  return all > unknowns ? 0.5 * meanUpTo(kOutlyingSquare * median, r2) * all / (all - unknowns)
                        : 1.0;
}

}  // namespace

TrackInformation::TrackInformation(const VisualWindow& window, double scale, double least_noise)
    : window_(window), scale_(scale), least_noise_(least_noise) {
  const KernelMoments kernel(scale * scale);
  score_scale_ = kernel.derivative / kernel.variance;
  fisher_share_ = kernel.derivative / kernel.weight;
}

void TrackInformation::start(const StereoPoints& points, const std::vector<SE3>& T_VB) {
  landmarks_.assign(window_.landmark_ids.size(), Vector3d::Zero());
  valid_.assign(window_.landmark_ids.size(), 0);
  at_infinity_.assign(window_.landmark_ids.size(), 0);
  r2_.assign(window_.measurements.size(), 0.0);
  rows_.assign(window_.measurements.size(), Row());
  T_VB_.clear();
  for (size_t l = 0; l < landmarks_.size(); ++l) {
    std::vector<Vector3d> in_V;
    for (const StereoPoints::Point& point : points.of_landmark[l])
      in_V.emplace_back(T_VB[point.keyframe] * point.p_B);
    if (in_V.empty()) continue;
    landmarks_[l] = medianOf(in_V);
    valid_[l] = 1;
  }
}

double TrackInformation::weight(double r2) const {
  const double w = c2_ / (c2_ + r2);
  return w * w;
}

void TrackInformation::place(const std::vector<SE3>& T_VB) {
  const auto same = [](const SE3& a, const SE3& b) { return a.R == b.R && a.t == b.t; };
  if (std::equal(T_VB.begin(), T_VB.end(), T_VB_.begin(), T_VB_.end(), same)) return;
  T_VB_ = T_VB;
  T_CV_.clear();
  for (const SE3& pose : T_VB)
    for (const SE3& T_CB : window_.T_CB) T_CV_.push_back(T_CB * pose.inverse());
  for (size_t l = 0; l < landmarks_.size(); ++l)
    if (valid_[l]) evaluate(l);
}

void TrackInformation::evaluate(size_t l) {
  for (int i = window_.first[l]; i < window_.first[l + 1]; ++i) {
    const VisualMeasurement& m = window_.measurements[i];
    const SE3& T_CV = T_CV_[kCameras * m.keyframe + m.camera];
    const Vector3d p_C = T_CV * landmarks_[l];
    Row& row = rows_[i];
    Matrix23 J;
    row.ahead = reprojectionResidual(m.measurement, p_C, 1.0, &row.r, &J);
    if (!row.ahead) continue;
    row.A.noalias() = J * T_CV.R;
    row.depth = m.measurement.R_MC.row(2).dot(p_C);
  }
}

double TrackInformation::shareOfDepth(int measurement, const Vector3d& step) const {
  const VisualMeasurement& m = window_.measurements[measurement];
  const Vector3d step_C = T_CV_[kCameras * m.keyframe + m.camera].R * step;
  return m.measurement.R_MC.row(2).dot(step_C) / rows_[measurement].depth;
}

double TrackInformation::moveLandmark(size_t l) {
  Matrix3d H = Matrix3d::Zero();
  Vector3d b = Vector3d::Zero();
  const int end = window_.first[l + 1];
  int first = end;
  double least_depth = 0.0;
  for (int i = window_.first[l]; i < end; ++i) {
    const Row& row = rows_[i];
    if (!row.ahead) continue;
    least_depth = first == end ? row.depth : std::min(least_depth, row.depth);
    first = std::min(first, i);
    const Matrix23 weighted = weight(row.r.squaredNorm()) * row.A;
    H.noalias() += weighted.transpose() * row.A;
    b.noalias() -= weighted.transpose() * row.r;
  }
  const Matrix3d root = inverseRoot(H);
  const Vector3d step = root * (root.transpose() * b);
  if (first == end || !step.allFinite()) return 0.0;
  at_infinity_[l] = 0;
  double most = 1.0;
  if (2.0 * step.norm() > least_depth) {  // a shorter one changes no depth by half
    // A depth grows by a share that is linear in its inverse: by all of it, and the inverse is zero.
    at_infinity_[l] = shareOfDepth(first, step) >= 1.0;
    // No step takes a depth to less than half: the rows of a landmark that comes to lie before a
    // camera would outweigh all others.
    for (int i = first; i < end; ++i)
      if (rows_[i].ahead) most = std::max(most, -2.0 * shareOfDepth(i, step));
  }
  landmarks_[l] += step / most;
  evaluate(l);
  return step.dot(b);
}

void TrackInformation::triangulate(const std::vector<SE3>& T_VB, int most_moves) {
  place(T_VB);
  for (size_t l = 0; l < landmarks_.size(); ++l) {
    if (!valid_[l]) continue;
    for (int move = 0; move < most_moves; ++move)
      if (moveLandmark(l) < kAtRest) break;
    for (int i = window_.first[l]; i < window_.first[l + 1]; ++i)
      r2_[i] = rows_[i].ahead ? rows_[i].r.squaredNorm() : kBehind;
  }
  updateScale(T_VB.size());
}

void TrackInformation::updateScale(size_t nodes) {
  std::vector<double> of_valid;
  of_valid.reserve(r2_.size());
  for (size_t i = 0; i < r2_.size(); ++i)
    if (valid_[window_.measurements[i].landmark]) of_valid.push_back(r2_[i]);
  if (of_valid.empty()) return;
  // |r| of two Gaussian coordinates has its median at 1.18 sigma: c is two sigmas of what is seen.
  constexpr double kFactor = 2.0 / 1.18;
  const double middle = median(of_valid);
  const double variance = noiseVariance(of_valid, middle, 3.0 * validCount() + 6.0 * (nodes - 1.0));
  const double least = scale_ * scale_ * std::clamp(variance, least_noise_ * least_noise_, 1.0);
  c2_ = kFactor * kFactor * middle > scale_ * scale_ ? kFactor * kFactor * middle : least;
}

void TrackInformation::linearize(const std::vector<SE3>& T_VB) {
  place(T_VB);
  const Index n = 6 * (T_VB.size() - 1);
  S_.setZero(n, n);
  s_.setZero(n);
  by_landmark_.setZero(n, 3 * validCount());
  Index column = 0;
  for (size_t l = 0; l < landmarks_.size(); ++l)
    if (valid_[l]) eliminate(l, T_VB, 3 * column++);
  S_.selfadjointView<Eigen::Lower>().rankUpdate(by_landmark_, -1.0);
  S_.triangularView<Eigen::StrictlyUpper>() = S_.transpose();
  // So far rotations turn about the axes of V.
  for (size_t k = 1; k < T_VB.size(); ++k) {
    const Index at = 6 * (static_cast<Index>(k) - 1);
    const Matrix3d& R_VB = T_VB[k].R;
    S_.middleRows<3>(at) = (R_VB.transpose() * S_.middleRows<3>(at)).eval();
    S_.middleCols<3>(at) = (S_.middleCols<3>(at) * R_VB).eval();
    s_.segment<3>(at) = (R_VB.transpose() * s_.segment<3>(at)).eval();
  }
  const double factor = score_scale_ * scale_ * scale_ / c2_;
  S_ *= factor;
  s_ *= factor;
}

void TrackInformation::eliminate(size_t l, const std::vector<SE3>& T_VB, Index column) {
  views_.clear();
  Matrix3d H = Matrix3d::Zero();
  Vector3d b = Vector3d::Zero();
  for (int i = window_.first[l]; i < window_.first[l + 1]; ++i) {
    const Row& row = rows_[i];
    if (!row.ahead) continue;
    const int node = window_.measurements[i].keyframe;
    const Matrix23 weighted = weight(row.r.squaredNorm()) * row.A;
    if (views_.empty() || views_.back().node != node) views_.push_back({node});
    views_.back().information.noalias() += weighted.transpose() * row.A;
    views_.back().gradient.noalias() += weighted.transpose() * row.r;
  }
  for (const View& view : views_) {
    H += view.information;
    b -= view.gradient;
  }
  // A landmark seen in one direction only: the tiny term keeps its far end from being a division by
  // zero, at 1e-9 of the weight of the rest.
  H.diagonal().array() += 1e-9 * H.trace();
  Matrix3d root = inverseRoot(H);  // H_l H^-1 H_l^T is a product with itself
  if (!root.allFinite()) root.setZero();
  const Vector3d root_b = root.transpose() * b;
  for (const View& view : views_) {
    if (view.node == 0) continue;  // the frame V itself
    // A pose moves the landmark that it sees: derivatives by [rotation, position] are A [Q, -I].
    const Index at = 6 * (view.node - 1);
    const Matrix3d& N = view.information;
    const Matrix3d Q = hat(landmarks_[l] - T_VB[view.node].t), NQ = N * Q;
    S_.block<3, 3>(at, at).noalias() -= Q * NQ;
    S_.block<3, 3>(at + 3, at) -= NQ;
    S_.block<3, 3>(at + 3, at + 3) += N;
    auto H_l = by_landmark_.block<6, 3>(at, column);
    H_l.topRows<3>().noalias() = NQ.transpose() * root;
    H_l.bottomRows<3>().noalias() = -N * root;
    s_.segment<3>(at).noalias() += Q * view.gradient;
    s_.segment<3>(at + 3) += view.gradient;
    s_.segment<6>(at).noalias() -= H_l * root_b;
  }
}

NormalEquations TrackInformation::information(const std::vector<SE3>& T_VB) const {
  std::vector<InverseDepthLandmark> landmarks;
  for (int l = 0; l < window_.landmarkCount(); ++l) {
    const size_t index = l;
    const VisualMeasurement& first = *window_.measurementsOf(index).begin();
    const SE3 T_VC = T_VB[first.keyframe] * window_.T_CB[first.camera].inverse();
    landmarks.emplace_back(valid_[index] ? landmarks_[index] : Vector3d(T_VC * Vector3d::UnitZ()),
                           T_VC.t);
    if (at_infinity_[index]) landmarks.back().parameters.z() = 0.0;
  }
  const double factor = score_scale_ * scale_ * scale_ / c2_;
  const RobustWeights weights = [&](const VisualMeasurement& m, double r2) {
    const double w = valid_[m.landmark] ? factor * weight(r2) : 0.0;
    return RobustWeight{w, fisher_share_ * w};
  };
  NormalEquations all(6 * T_VB.size());
  addReducedVisualInformation(window_, T_VB, {landmarks, at_infinity_}, weights, &all);
  const Index n = all.score.rows() - 6;  // the first pose is the frame
  NormalEquations equations(n);
  equations.add(0, 0, all.score.bottomRightCorner(n, n));
  equations.curvature = all.curvature.bottomRightCorner(n, n);
  return equations;
}

int TrackInformation::validCount() const { return std::count(valid_.begin(), valid_.end(), 1); }

double TrackInformation::inlierShare(double max_chi2) const {
  int inliers = 0, all = 0;
  for (size_t i = 0; i < r2_.size(); ++i) {
    if (!valid_[window_.measurements[i].landmark]) continue;
    ++all;
    inliers += r2_[i] <= max_chi2;
  }
  return all > 0 ? static_cast<double>(inliers) / all : 0.0;
}

}  // namespace etalon
