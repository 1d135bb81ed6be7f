#include "rest.h"

#include <algorithm>
#include <cmath>

#include "etalon/core/so3.h"
#include "etalon/core/statistics.h"

namespace etalon::fixed_lag {
namespace {

constexpr double kCalmFor = 0.5;  // s
// Median distance of tracks between two frames, in sigma_px; with Gaussian noise 1.67 at rest.
constexpr double kMoved = 2.2;
constexpr size_t kFewestTracks = 20;  // fewer say too little for a median
constexpr double kMostSpeed = 0.05;   // m/s; a faster platform is not at rest
// Standard deviations of the worst axis. A MEMS sensor's noise is a tenth of them; a flying
// platform has several times as much.
constexpr double kCalmGyro = 0.02;  // rad/s
constexpr double kCalmAccel = 0.2;  // m/s^2

// At rest, of the pose from frame to frame and of the velocity. Over an hour at 20 Hz the first two
// add up to 3 mm and 0.15 deg.
constexpr double kSigmaRotation = 1e-5;  // rad
constexpr double kSigmaPosition = 1e-5;  // m
constexpr double kSigmaVelocity = 1e-3;  // m/s

}  // namespace

bool RestDetector::imuIsCalm() const {
  if (imu_.size() < 10 || secondsBetween(imu_.front().t, imu_.back().t) < 0.9 * kCalmFor)
    return false;
  const auto n = static_cast<double>(imu_.size());
  Eigen::Matrix<double, 6, 1> sum = Eigen::Matrix<double, 6, 1>::Zero(), squares = sum;
  for (const ImuSample& sample : imu_) {
    Eigen::Matrix<double, 6, 1> x;
    x << sample.gyro - imu_.front().gyro, sample.accel - imu_.front().accel;
    sum += x;
    squares += x.cwiseAbs2();
  }
  const Eigen::Matrix<double, 6, 1> variance = squares / n - (sum / n).cwiseAbs2();
  return variance.head<3>().maxCoeff() < kCalmGyro * kCalmGyro &&
         variance.tail<3>().maxCoeff() < kCalmAccel * kCalmAccel;
}

bool RestDetector::atRest(const TrackedFrame& frame, const std::vector<ImuSample>& imu,
                          double sigma_px, double speed) {
  if (imu.empty() || frame.observations.size() < kFewestTracks) {
    *this = RestDetector();
    return false;
  }
  imu_.insert(imu_.end(), imu.begin() + 1, imu.end());
  while (secondsBetween(imu_.front().t, imu_.back().t) > kCalmFor) imu_.pop_front();
  Reference now;
  now.t = frame.t;
  std::vector<double> moved;
  for (const Observation& o : frame.observations) {
    now.pixels[o.id] = o.left;
    if (references_.empty()) continue;
    const auto before = references_.front().pixels.find(o.id);
    if (before != references_.front().pixels.end())
      moved.push_back((o.left - before->second).norm());
  }
  const bool long_enough =
      !references_.empty() && secondsBetween(references_.front().t, frame.t) >= 0.9 * kCalmFor;
  const bool was_at_rest = at_rest_;
  at_rest_ = long_enough && moved.size() >= kFewestTracks &&
             median(std::move(moved)) < kMoved * sigma_px && speed < kMostSpeed && imuIsCalm();
  references_.push_back(std::move(now));
  if (at_rest_)  // the first one stays until the rest ends
    references_.erase(references_.begin() + 1, references_.end());
  else if (was_at_rest)
    references_.erase(references_.begin(), references_.end() - 1);
  while (!at_rest_ && secondsBetween(references_.front().t, frame.t) > kCalmFor)
    references_.pop_front();
  return at_rest_;
}

Eigen::Matrix<double, 9, 1> restRows(const Window& window, size_t i, RestJacobian* J_i,
                                     RestJacobian* J_j) {
  const WindowState &a = window.states[i - 1], &b = window.states[i];
  Eigen::Matrix<double, 9, 1> weight;
  weight << Eigen::Vector3d::Constant(1.0 / kSigmaRotation),
      Eigen::Vector3d::Constant(1.0 / kSigmaPosition),
      Eigen::Vector3d::Constant(1.0 / kSigmaVelocity);
  Eigen::Matrix<double, 9, 1> r;
  r << logSO3(a.now.T_WB.R.transpose() * b.now.T_WB.R), b.now.T_WB.t - a.now.T_WB.t, b.now.v_WB;
  if (J_i) {
    const bool moved = a.fixed || b.fixed;
    const Eigen::Matrix3d& R_a = moved ? a.linearization.T_WB.R : a.now.T_WB.R;
    const Eigen::Matrix3d& R_b = moved ? b.linearization.T_WB.R : b.now.T_WB.R;
    const Eigen::Matrix3d R = R_a.transpose() * R_b;
    J_i->setZero();
    J_j->setZero();
    J_j->block<3, 3>(0, 0) = rightJacobianInverseSO3(logSO3(R));
    J_i->block<3, 3>(0, 0) = -J_j->block<3, 3>(0, 0) * R.transpose();
    J_j->block<3, 3>(3, 3).setIdentity();
    J_i->block<3, 3>(3, 3) = -Eigen::Matrix3d::Identity();
    J_j->block<3, 3>(6, 6).setIdentity();
    *J_i = weight.asDiagonal() * (*J_i);
    *J_j = weight.asDiagonal() * (*J_j);
  }
  return weight.cwiseProduct(r);
}

}  // namespace etalon::fixed_lag
