#include "etalon/initialization/steps/track_information.h"

#include <Eigen/Cholesky>
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "etalon/core/so3.h"
#include "etalon/core/statistics.h"
#include "etalon/optimization/bundle/reduced_information.h"

namespace etalon {

using Eigen::Index;
using Eigen::Matrix3d;
using Eigen::Vector2d;
using Eigen::Vector3d;
using Matrix23 = Eigen::Matrix<double, 2, 3>;
using Matrix26 = Eigen::Matrix<double, 2, 6>;

namespace {

constexpr double kBehind = 1e12;  // squared residual of a landmark that no camera can see

/**
 * Expectations of the weight w = (c^2 / (c^2 + r^2))^2 over residuals of two standard normal
 * coordinates, r^2 / 2 being exponentially distributed: of w; of the score's derivative; of the
 * score's variance (Huber and Ronchetti, Robust Statistics, chapter 6).
 */
struct KernelMoments {
  double weight = 0.0, derivative = 0.0, variance = 0.0;

  explicit KernelMoments(double c2) {
    constexpr int kPoints = 4000;  // of the midpoint rule on r^2 / 2 from 0 to 40
    constexpr double kStep = 0.01;
    double mass = 0.0;
    for (int i = 0; i < kPoints; ++i) {
      const double half = kStep * (i + 0.5), density = std::exp(-half);
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

/**
 * Variance of a coordinate as squared residuals of two show it, `unknowns` having been fitted.
 * Residuals of more than four times the median, one of 6e4 Gaussian ones, are outliers.
 */
double noiseVariance(const std::vector<double>& r2, double median, double unknowns) {
  double sum = 0.0, rows = 0.0;
  for (const double square : r2) {
    if (square > 16.0 * median) continue;
    sum += square;
    rows += 2.0;
  }
  const double all = 2.0 * r2.size();
  return all > unknowns ? sum / rows * all / (all - unknowns) : 1.0;
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

void TrackInformation::moveLandmark(int l, const std::vector<SE3>& T_VB) {
  const size_t index = l;
  Matrix3d H = Matrix3d::Zero();
  Vector3d b = Vector3d::Zero();
  towards_.clear();
  for (int i = window_.first[index]; i < window_.first[index + 1]; ++i) {
    const VisualMeasurement& m = window_.measurements[i];
    const SE3& T_CB = window_.T_CB[m.camera];
    const SE3& pose = T_VB[m.keyframe];
    Vector2d r;
    Matrix23 A;
    if (!reprojectionResidual(T_CB, m.measurement, pose, landmarks_[index], &r, nullptr, &A))
      continue;
    const double w = weight(r.squaredNorm());
    H.noalias() += w * A.transpose() * A;
    b.noalias() -= w * A.transpose() * r;
    const Eigen::RowVector3d axis_C = m.measurement.R_MC.row(2);
    const Vector3d axis = pose.R * (axis_C * T_CB.R).transpose();
    towards_.emplace_back(axis / (axis.dot(landmarks_[index] - pose.t) + axis_C.dot(T_CB.t)));
  }
  const Eigen::LDLT<Matrix3d> factor(H);
  const Vector3d step = factor.solve(b);
  if (!factor.isPositive() || !step.allFinite()) return;
  // A depth grows by a share that is linear in its inverse: by all of it, and the inverse is zero.
  at_infinity_[index] = towards_.front().dot(step) >= 1.0;
  // No step takes a depth to less than half: the rows of a landmark that comes to lie before a
  // camera would outweigh all others.
  double most = 1.0;
  for (const Vector3d& by_depth : towards_) most = std::max(most, -2.0 * by_depth.dot(step));
  landmarks_[index] += step / most;
}

void TrackInformation::triangulate(const std::vector<SE3>& T_VB) {
  for (int l = 0; l < window_.landmarkCount(); ++l) {
    const size_t index = l;
    if (!valid_[index]) continue;
    moveLandmark(l, T_VB);
    for (int i = window_.first[index]; i < window_.first[index + 1]; ++i) {
      const VisualMeasurement& m = window_.measurements[i];
      Vector2d r;
      const bool seen = reprojectionResidual(window_.T_CB[m.camera], m.measurement,
                                             T_VB[m.keyframe], landmarks_[index], &r);
      r2_[i] = seen ? r.squaredNorm() : kBehind;
    }
  }
  updateScale(T_VB.size());
}

void TrackInformation::updateScale(size_t nodes) {
  std::vector<double> of_valid;
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
  const Index n = 6 * (T_VB.size() - 1);
  S_.setZero(n, n);
  s_.setZero(n);
  by_landmark_.setZero(n, 3 * validCount());
  Index column = 0;
  for (int l = 0; l < window_.landmarkCount(); ++l)
    if (valid_[l]) eliminate(l, T_VB, 3 * column++);
  S_.selfadjointView<Eigen::Lower>().rankUpdate(by_landmark_, -1.0);
  S_.triangularView<Eigen::StrictlyUpper>() = S_.transpose();
  const double factor = score_scale_ * scale_ * scale_ / c2_;
  S_ *= factor;
  s_ *= factor;
}

void TrackInformation::eliminate(int l, const std::vector<SE3>& T_VB, Index column) {
  const size_t index = l;
  nodes_.clear();
  auto H_l = by_landmark_.middleCols<3>(column);
  Matrix3d H = Matrix3d::Zero();
  Vector3d b = Vector3d::Zero();
  for (int i = window_.first[index]; i < window_.first[index + 1]; ++i) {
    const VisualMeasurement& m = window_.measurements[i];
    Vector2d r;
    Matrix26 J;
    Matrix23 A;
    if (!reprojectionResidual(window_.T_CB[m.camera], m.measurement, T_VB[m.keyframe],
                              landmarks_[index], &r, &J, &A))
      continue;
    const double root = std::sqrt(weight(r.squaredNorm()));
    r *= root;
    J *= root;
    A *= root;
    H.noalias() += A.transpose() * A;
    b.noalias() -= A.transpose() * r;
    if (m.keyframe == 0) continue;  // the frame V itself
    const Index at = 6 * (m.keyframe - 1);
    if (nodes_.empty() || nodes_.back() != at) nodes_.push_back(at);
    H_l.middleRows<6>(at).noalias() += J.transpose() * A;
    S_.block<6, 6>(at, at).noalias() += J.transpose() * J;
    s_.segment<6>(at).noalias() -= J.transpose() * r;
  }
  // A landmark seen in one direction only: the tiny term keeps its far end from being a division by
  // zero, at 1e-9 of the weight of the rest.
  H.diagonal().array() += 1e-9 * H.trace();
  const Eigen::LLT<Matrix3d> factor(H);  // H_l H^-1 H_l^T is a product with itself
  Matrix3d root_inverse = Matrix3d::Identity();
  factor.matrixL().solveInPlace(root_inverse);
  const bool usable = factor.info() == Eigen::Success && root_inverse.allFinite();
  if (!usable) root_inverse.setZero();
  const Vector3d root_b = root_inverse * b;
  for (const Index at : nodes_) {
    const Eigen::Matrix<double, 6, 3> whitened = H_l.middleRows<6>(at) * root_inverse.transpose();
    H_l.middleRows<6>(at) = whitened;
    s_.segment<6>(at).noalias() -= whitened * root_b;
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
  addReducedVisualInformation(window_, T_VB, {landmarks, at_infinity_}, weights, 6, &all);
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
