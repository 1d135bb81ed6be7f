#include "track_information.h"

#include <Eigen/Cholesky>
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "etalon/core/so3.h"

namespace etalon::plugins {

using Eigen::Index;
using Eigen::Matrix3d;
using Eigen::Vector2d;
using Eigen::Vector3d;
using Matrix23 = Eigen::Matrix<double, 2, 3>;

namespace {

constexpr double kMinDepth = 0.1;    // m
constexpr double kMaxDepth = 100.0;  // m: beyond, disparity says nothing

double medianOf(std::vector<double>* values) {
  const auto middle = values->begin() + static_cast<std::ptrdiff_t>(values->size() / 2);
  std::nth_element(values->begin(), middle, values->end());
  return *middle;
}

Vector3d medianOf(const std::vector<Vector3d>& points) {
  Vector3d result;
  std::vector<double> values(points.size());
  for (int axis = 0; axis < 3; ++axis) {
    for (size_t i = 0; i < points.size(); ++i) values[i] = points[i][axis];
    result[axis] = medianOf(&values);
  }
  return result;
}

/** S [I | -xy] / depth, 2x3: takes p_C to the residual. */
Matrix23 rows(const ReprojectionMeasurement& m, double depth) {
  Matrix23 P;
  P.leftCols<2>() = m.sqrt_information / depth;
  P.col(2) = -(m.sqrt_information * m.xy) / depth;
  return P;
}

/** Where two rays of one rig come nearest to each other, in the body frame; false if nowhere. */
bool meet(const VisualWindow& window, const VisualMeasurement& left, const VisualMeasurement& right,
          double max_chi2, Vector3d* p_B) {
  const SE3 T_BC0 = window.T_CB[0].inverse(), T_BC1 = window.T_CB[1].inverse();
  const Vector3d f0 = T_BC0.R * left.measurement.xy.homogeneous();
  const Vector3d f1 = T_BC1.R * right.measurement.xy.homogeneous();
  const Vector3d d = T_BC1.t - T_BC0.t;
  const double a = f0.squaredNorm(), b = f0.dot(f1), c = f1.squaredNorm();
  const double determinant = a * c - b * b;
  if (!(determinant > 1e-12)) return false;
  const double z0 = (c * f0.dot(d) - b * f1.dot(d)) / determinant;
  const double z1 = (b * f0.dot(d) - a * f1.dot(d)) / determinant;
  if (!(z0 > kMinDepth && z1 > kMinDepth && z0 < kMaxDepth)) return false;
  *p_B = 0.5 * (T_BC0.t + z0 * f0 + T_BC1.t + z1 * f1);
  double chi2 = 0.0;
  for (const VisualMeasurement* m : {&left, &right}) {
    const Vector3d p_C = window.T_CB[static_cast<size_t>(m->camera)] * *p_B;
    chi2 += (rows(m->measurement, p_C.z()) * p_C).squaredNorm();
  }
  return chi2 <= max_chi2;
}

}  // namespace

StereoPoints stereoPoints(const VisualWindow& window, double max_chi2) {
  StereoPoints points;
  points.of_landmark.resize(window.landmark_ids.size());
  for (size_t i = 0; i + 1 < window.measurements.size(); ++i) {
    const VisualMeasurement &left = window.measurements[i], &right = window.measurements[i + 1];
    if (left.landmark != right.landmark || left.keyframe != right.keyframe) continue;
    Vector3d p_B;
    if (meet(window, left, right, max_chi2, &p_B))
      points.of_landmark[static_cast<size_t>(left.landmark)].push_back({left.keyframe, p_B});
  }
  return points;
}

std::vector<SE3> medianPositions(const StereoPoints& points, const std::vector<Matrix3d>& R_VB) {
  std::vector<std::vector<Vector3d>> steps(R_VB.size());
  for (const auto& seen : points.of_landmark)
    for (size_t i = 1; i < seen.size(); ++i) {
      if (seen[i].keyframe != seen[i - 1].keyframe + 1) continue;
      const auto k = static_cast<size_t>(seen[i].keyframe);
      steps[k].emplace_back(R_VB[k - 1] * seen[i - 1].p_B - R_VB[k] * seen[i].p_B);
    }
  std::vector<SE3> T_VB{SE3(R_VB[0], Vector3d::Zero())};
  Vector3d step = Vector3d::Zero();
  for (size_t k = 1; k < R_VB.size(); ++k) {
    if (!steps[k].empty()) step = medianOf(steps[k]);  // else as the step before
    T_VB.emplace_back(R_VB[k], T_VB[k - 1].t + step);
  }
  return T_VB;
}

void TrackInformation::start(const StereoPoints& points, const std::vector<SE3>& T_VB) {
  landmarks_.assign(window_.landmark_ids.size(), Vector3d::Zero());
  valid_.assign(window_.landmark_ids.size(), 0);
  r2_.assign(window_.measurements.size(), 0.0);
  for (size_t l = 0; l < landmarks_.size(); ++l) {
    std::vector<Vector3d> in_V;
    for (const StereoPoints::Point& point : points.of_landmark[l])
      in_V.emplace_back(T_VB[static_cast<size_t>(point.keyframe)] * point.p_B);
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
  const auto index = static_cast<size_t>(l);
  Matrix3d H = Matrix3d::Zero();
  Vector3d b = Vector3d::Zero();
  for (int i = window_.first[index]; i < window_.first[index + 1]; ++i) {
    const VisualMeasurement& m = window_.measurements[static_cast<size_t>(i)];
    const SE3& T_CB = window_.T_CB[static_cast<size_t>(m.camera)];
    const SE3& pose = T_VB[static_cast<size_t>(m.keyframe)];
    const Vector3d p_B = pose.R.transpose() * (landmarks_[index] - pose.t);
    const Vector3d p_C = T_CB * p_B;
    if (p_C.z() < kMinDepth) continue;
    const Matrix23 P = rows(m.measurement, p_C.z());
    const Vector2d r = P * p_C;
    const Matrix23 A = P * T_CB.R * pose.R.transpose();
    const double w = weight(r.squaredNorm());
    H.noalias() += w * A.transpose() * A;
    b.noalias() -= w * A.transpose() * r;
  }
  const Eigen::LDLT<Matrix3d> factor(H);
  const Vector3d step = factor.solve(b);
  if (factor.isPositive() && step.allFinite()) landmarks_[index] += step;
}

void TrackInformation::triangulate(const std::vector<SE3>& T_VB) {
  for (int l = 0; l < window_.landmarkCount(); ++l) {
    const auto index = static_cast<size_t>(l);
    if (!valid_[index]) continue;
    moveLandmark(l, T_VB);
    for (int i = window_.first[index]; i < window_.first[index + 1]; ++i) {
      const VisualMeasurement& m = window_.measurements[static_cast<size_t>(i)];
      const SE3& pose = T_VB[static_cast<size_t>(m.keyframe)];
      const Vector3d p_C = window_.T_CB[static_cast<size_t>(m.camera)] *
                           (pose.R.transpose() * (landmarks_[index] - pose.t));
      r2_[static_cast<size_t>(i)] =
          p_C.z() < kMinDepth ? 1e12 : (rows(m.measurement, p_C.z()) * p_C).squaredNorm();
    }
  }
  updateScale();
}

void TrackInformation::updateScale() {
  std::vector<double> of_valid;
  for (size_t i = 0; i < r2_.size(); ++i)
    if (valid_[static_cast<size_t>(window_.measurements[i].landmark)]) of_valid.push_back(r2_[i]);
  if (of_valid.empty()) return;
  // |r| of two Gaussian coordinates has its median at 1.18 sigma: c is two sigmas of what is seen.
  constexpr double kFactor = 2.0 / 1.18;
  c2_ = std::max(scale_ * scale_, kFactor * kFactor * medianOf(&of_valid));
}

void TrackInformation::linearize(const std::vector<SE3>& T_VB) {
  const Index n = 6 * (static_cast<Index>(T_VB.size()) - 1);
  S_.setZero(n, n);
  s_.setZero(n);
  for (int l = 0; l < window_.landmarkCount(); ++l)
    if (valid_[static_cast<size_t>(l)]) eliminate(l, T_VB);
  S_.triangularView<Eigen::StrictlyUpper>() = S_.transpose();
  const double tempering = scale_ * scale_ / c2_;
  S_ *= tempering;
  s_ *= tempering;
}

void TrackInformation::eliminate(int l, const std::vector<SE3>& T_VB) {
  const auto index = static_cast<size_t>(l);
  struct Block {
    int node;
    Eigen::Matrix<double, 6, 3> H_kl;
  };
  std::vector<Block> blocks;
  Matrix3d H = Matrix3d::Zero();
  Vector3d b = Vector3d::Zero();
  for (int i = window_.first[index]; i < window_.first[index + 1]; ++i) {
    const VisualMeasurement& m = window_.measurements[static_cast<size_t>(i)];
    const SE3& T_CB = window_.T_CB[static_cast<size_t>(m.camera)];
    const SE3& pose = T_VB[static_cast<size_t>(m.keyframe)];
    const Vector3d p_B = pose.R.transpose() * (landmarks_[index] - pose.t);
    const Vector3d p_C = T_CB * p_B;
    if (p_C.z() < kMinDepth) continue;
    const Matrix23 P = rows(m.measurement, p_C.z());
    const double root = std::sqrt(weight((P * p_C).squaredNorm()));
    const Vector2d r = root * (P * p_C);
    const Matrix23 PR = root * P * T_CB.R;
    const Matrix23 A = PR * pose.R.transpose();
    H.noalias() += A.transpose() * A;
    b.noalias() -= A.transpose() * r;
    if (m.keyframe == 0) continue;  // the frame V itself
    Eigen::Matrix<double, 2, 6> J;
    J.leftCols<3>() = PR * hat(p_B);
    J.rightCols<3>() = -A;
    if (blocks.empty() || blocks.back().node != m.keyframe - 1)
      blocks.push_back({m.keyframe - 1, Eigen::Matrix<double, 6, 3>::Zero()});
    blocks.back().H_kl.noalias() += J.transpose() * A;
    const Index at = 6 * (m.keyframe - 1);
    S_.block<6, 6>(at, at).noalias() += J.transpose() * J;
    s_.segment<6>(at).noalias() -= J.transpose() * r;
  }
  // A landmark seen in one direction only: the tiny term keeps its far end from being a division by
  // zero, at 1e-9 of the weight of the rest.
  H.diagonal().array() += 1e-9 * H.trace();
  const Matrix3d inverse = H.ldlt().solve(Matrix3d::Identity());
  if (!inverse.allFinite()) return;
  for (const Block& row : blocks) {
    const Eigen::Matrix<double, 6, 3> HI = row.H_kl * inverse;
    s_.segment<6>(6 * row.node).noalias() -= HI * b;
    for (const Block& column : blocks) {
      if (column.node > row.node) break;
      S_.block<6, 6>(6 * row.node, 6 * column.node).noalias() -= HI * column.H_kl.transpose();
    }
  }
}

int TrackInformation::validCount() const {
  return static_cast<int>(std::count(valid_.begin(), valid_.end(), 1));
}

double TrackInformation::inlierShare(double max_chi2) const {
  int inliers = 0, all = 0;
  for (size_t i = 0; i < r2_.size(); ++i) {
    if (!valid_[static_cast<size_t>(window_.measurements[i].landmark)]) continue;
    ++all;
    inliers += r2_[i] <= max_chi2;
  }
  return all > 0 ? static_cast<double>(inliers) / all : 0.0;
}

}  // namespace etalon::plugins
