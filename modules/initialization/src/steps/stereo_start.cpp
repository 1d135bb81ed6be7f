#include "etalon/initialization/steps/stereo_start.h"

#include <Eigen/Cholesky>
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <utility>

#include "etalon/core/so3.h"
#include "etalon/core/statistics.h"

namespace etalon {

using Eigen::Matrix3d;
using Eigen::Vector3d;

Vector3d medianOf(const std::vector<Vector3d>& points) {
  Vector3d result;
  std::vector<double> values(points.size());
  for (int axis = 0; axis < 3; ++axis) {
    for (size_t i = 0; i < points.size(); ++i) values[i] = points[i][axis];
    result[axis] = median(values);
  }
  return result;
}

namespace {

constexpr double kMinDepth = 0.1;    // m
constexpr double kMaxDepth = 100.0;  // m: beyond, disparity says nothing

/** Where two rays of one rig come nearest to each other, in the body frame; false if nowhere. */
bool meet(const VisualWindow& window, const VisualMeasurement& left, const VisualMeasurement& right,
          double max_chi2, Vector3d* p_B) {
  const SE3 T_BC0 = window.T_CB[0].inverse(), T_BC1 = window.T_CB[1].inverse();
  const Matrix3d R_BM0 = T_BC0.R * left.measurement.R_MC.transpose();
  const Matrix3d R_BM1 = T_BC1.R * right.measurement.R_MC.transpose();
  const Vector3d f0 = R_BM0 * left.measurement.xy.homogeneous();
  const Vector3d f1 = R_BM1 * right.measurement.xy.homogeneous();
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
    Eigen::Vector2d r;
    if (!reprojectionResidual(window.T_CB[m->camera], m->measurement, SE3(), *p_B, &r))
      return false;
    chi2 += r.squaredNorm();
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
      points.of_landmark[left.landmark].push_back({left.keyframe, p_B});
  }
  return points;
}

namespace {

/** A landmark in two neighbouring keyframes: y = t + G b, whitened by `root`. The products are those
 * of the normal equations. */
struct TurnedPoint {
  size_t step;
  Vector3d y;
  Matrix3d G, root;
  Matrix3d W, WG, GtWG;
  Vector3d Wy, GtWy;

  TurnedPoint(size_t from, const Vector3d& difference, const Matrix3d& by_bias,
              const Matrix3d& whitening)
      : step(from), y(difference), G(by_bias), root(whitening) {
    W.noalias() = root * root;
    WG.noalias() = W * G;
    GtWG.noalias() = G.transpose() * WG;
    Wy.noalias() = W * y;
    GtWy.noalias() = WG.transpose() * y;
  }
};

/** Of every step at most kMostPoints, spread over its landmarks. */
std::vector<TurnedPoint> turnedPoints(const StereoPoints& points,
                                      const std::vector<Preintegration>& preintegrations,
                                      double baseline_m) {
  constexpr size_t kMostPoints = 50;  // tell b_g better than what comes after needs
  std::vector<std::vector<std::pair<const Vector3d*, const Vector3d*>>> of_step(
      preintegrations.size());
  for (const auto& seen : points.of_landmark)
    for (size_t i = 1; i < seen.size(); ++i)
      if (seen[i].keyframe == seen[i - 1].keyframe + 1)
        of_step[seen[i - 1].keyframe].emplace_back(&seen[i - 1].p_B, &seen[i].p_B);
  std::vector<TurnedPoint> result;
  for (size_t step = 0; step < of_step.size(); ++step) {
    const Preintegration& imu = preintegrations[step];
    const size_t count = std::min(kMostPoints, of_step[step].size());
    for (size_t i = 0; i < count; ++i) {
      const auto [before, after] = of_step[step][i * of_step[step].size() / count];
      const Vector3d &p = *before, &q = *after;
      const double range = p.norm();
      const Matrix3d along = p * p.transpose() / (range * range);
      result.emplace_back(step, p - imu.deltas().dR * q, -imu.deltas().dR * hat(q) * imu.dR_dbg(),
                          (Matrix3d::Identity() - along + baseline_m / range * along) / range);
    }
  }
  return result;
}

}  // namespace

Vector3d gyroBiasOfPoints(const StereoPoints& points,
                          const std::vector<Preintegration>& preintegrations, double baseline_m,
                          double sigma_prior_rps) {
  constexpr int kIterations = 10;
  constexpr double kStill = 1e-5;  // rad/s: what comes after starts from here
  constexpr double kNoise = 1e-3;  // rad: residuals below are not told apart
  const std::vector<TurnedPoint> turned = turnedPoints(points, preintegrations, baseline_m);
  const size_t steps = preintegrations.size();
  std::vector<Vector3d> t(steps, Vector3d::Zero());
  Vector3d b = Vector3d::Zero();
  for (int iteration = 0; iteration < kIterations; ++iteration) {
    // The steps are eliminated: T t = y - U b.
    std::vector<Matrix3d> T(steps, 1e-9 * Matrix3d::Identity()), U(steps, Matrix3d::Zero());
    std::vector<Vector3d> y(steps, Vector3d::Zero());
    Matrix3d H = kNoise / (sigma_prior_rps * sigma_prior_rps) * Matrix3d::Identity();
    Vector3d h = Vector3d::Zero();
    for (const TurnedPoint& point : turned) {
      const size_t k = point.step;
      const Vector3d e = point.root * (point.y - t[k] - point.G * b);
      const double weight = iteration == 0 ? 1.0 : 1.0 / std::max(e.norm(), kNoise);
      T[k] += weight * point.W;
      U[k] += weight * point.WG;
      y[k] += weight * point.Wy;
      H += weight * point.GtWG;
      h += weight * point.GtWy;
    }
    for (size_t k = 0; k < steps; ++k) {
      const Matrix3d by_T = T[k].ldlt().solve(U[k]);
      H -= U[k].transpose() * by_T;
      h -= by_T.transpose() * y[k];
    }
    const Vector3d before = b;
    b = H.ldlt().solve(h);
    for (size_t k = 0; k < steps; ++k) t[k] = T[k].ldlt().solve(y[k] - U[k] * b);
    if (!((b - before).norm() > kStill) && iteration > 0) break;
  }
  return preintegrations.front().bias().gyro + (b.allFinite() ? b : Vector3d::Zero());
}

std::vector<SE3> medianPositions(const StereoPoints& points, const std::vector<Matrix3d>& R_VB) {
  std::vector<std::vector<Vector3d>> steps(R_VB.size());
  for (const auto& seen : points.of_landmark)
    for (size_t i = 1; i < seen.size(); ++i) {
      if (seen[i].keyframe != seen[i - 1].keyframe + 1) continue;
      const size_t k = seen[i].keyframe;
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

}  // namespace etalon
