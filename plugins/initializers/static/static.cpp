#include <Eigen/Cholesky>
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "etalon/core/so3.h"
#include "etalon/core/statistics.h"
#include "etalon/core/stopwatch.h"
#include "etalon/imu/mean_sample.h"
#include "etalon/initialization/initializer.h"
#include "etalon/initialization/steps/gravity_alignment.h"
#include "etalon/optimization/residuals/cauchy.h"

namespace etalon::plugins {

using Eigen::Matrix3d;
using Eigen::Vector3d;

namespace {

/** Mean and, per axis, standard deviation of the IMU's readings in a window. */
struct ImuStatistics {
  int samples = 0;
  ImuSample mean;
  double gyro_std = 0.0, accel_std = 0.0;  ///< of the worst axis, rad/s and m/s^2

  explicit ImuStatistics(const std::vector<ImuSample>& window)
      : samples(window.size()), mean(meanSample(window)) {
    Vector3d gyro2 = Vector3d::Zero(), accel2 = Vector3d::Zero();
    for (const ImuSample& s : window) {
      gyro2 += (s.gyro - mean.gyro).cwiseAbs2() / samples;
      accel2 += (s.accel - mean.accel).cwiseAbs2() / samples;
    }
    gyro_std = std::sqrt(gyro2.maxCoeff());
    accel_std = std::sqrt(accel2.maxCoeff());
  }
};

/** Calls with both observations of every landmark common to two frames. */
template <typename Function>
void forCommon(const TrackedFrame& a, const TrackedFrame& b, const Function& function) {
  size_t j = 0;
  for (const Observation& o : a.observations) {
    while (j < b.observations.size() && b.observations[j].id < o.id) ++j;
    if (j < b.observations.size() && b.observations[j].id == o.id) function(o, b.observations[j]);
  }
}

/** Lengths by which the landmarks common to two frames have moved in the left image, px. */
std::vector<double> displacements(const TrackedFrame& a, const TrackedFrame& b) {
  std::vector<double> result;
  forCommon(a, b, [&](const Observation& first, const Observation& later) {
    result.push_back((later.left - first.left).norm());
  });
  return result;
}

/**
 * How the camera has turned from one frame to another, w (rad): what the gyro has of a slow turn
 * looks like a bias. Each landmark common to both has f x f' = (I - f f^T) w with its bearings f and
 * f'; least squares with Cauchy's weights. Zero where the pixels' noise, as the median residual shows
 * it, would give as much in one window of a thousand.
 */
Vector3d turnBetween(const CameraModel& camera, const TrackedFrame& a, const TrackedFrame& b) {
  constexpr int kRounds = 5;
  constexpr double kFalseAlarmRate = 0.001, kLeastSigma = 1e-12;
  std::vector<std::pair<Vector3d, Vector3d>> bearings;
  forCommon(a, b, [&](const Observation& first, const Observation& later) {
    const auto f = camera.unproject(first.left), turned = camera.unproject(later.left);
    if (f && turned) bearings.emplace_back(f->normalized(), turned->normalized());
  });
  Vector3d w = Vector3d::Zero();
  double chi2 = 0.0;
  for (int round = 0; round < kRounds && !bearings.empty(); ++round) {
    std::vector<double> sizes;
    for (const auto& [f, turned] : bearings)
      sizes.push_back((f.cross(turned) - (w - f * f.dot(w))).norm());
    const double sigma = std::max(kLeastSigma, median(sizes) / kRayleighMedian);
    Matrix3d H = Matrix3d::Zero();
    Vector3d g = Vector3d::Zero();
    for (size_t i = 0; i < bearings.size(); ++i) {
      const auto& [f, turned] = bearings[i];
      const double x = sizes[i] / (kCauchyWidth * sigma), weight = 1.0 / (1.0 + x * x);
      H += weight * (Matrix3d::Identity() - f * f.transpose());
      g += weight * f.cross(turned);
    }
    w = H.llt().solve(g);
    chi2 = w.dot(H * w) / (sigma * sigma);
  }
  return chi2 > chiSquareQuantile(3.0, kFalseAlarmRate) ? w : Vector3d::Zero();
}

}  // namespace

/** Gravity and gyro bias of a platform that stands still (README.md beside this file). */
class Static : public Initializer {
  DEFINE_MRPT_OBJECT(Static, etalon::plugins)

 public:
  void declareParameters(ParameterSet& parameters) override {
    parameters.add("max_displacement_px", &max_displacement_, {0.0, 1000.0},
                   "The platform moves if the median landmark has moved farther in the left image "
                   "between the first and any later frame of the window, px.");
    parameters.add("max_gyro_std_rps", &max_gyro_std_, {0.0, 100.0},
                   "It moves if the standard deviation of an axis of the gyro is larger, rad/s "
                   "(EuRoC at rest: 0.005 with the motors off, to 0.07 with them on).");
    parameters.add("max_accel_std_mps2", &max_accel_std_, {0.0, 1000.0},
                   "It moves if the standard deviation of an axis of the accelerometer is larger, "
                   "m/s^2 (EuRoC at rest: 0.06 with the motors off, to 1.1 with them on).");
    parameters.add("max_gyro_mean_rps", &max_gyro_mean_, {0.0, 100.0},
                   "Refuse a mean rate that is larger than a bias can be, rad/s.");
    parameters.add("max_gravity_deviation_mps2", &max_gravity_deviation_, {0.0, 100.0},
                   "Refuse if the mean specific force differs from gravity by more, m/s^2.");
    parameters.add("min_tracks", &min_tracks_, {1, 100000},
                   "Refuse if fewer landmarks of the first frame are seen in a later one.");
    parameters.add("sigma_velocity_mps", &sigma_velocity_, {0.0, 100.0},
                   "Standard deviation of the velocity's components, for the covariance, m/s.");
  }
  bool needsVisualSolution() const override { return false; }

 protected:
  InitializationResult solve(const InitializationProblem& problem) const override {
    Stopwatch watch;
    if (const auto still = checkImages(problem); !still) return refuse(still.error());
    const double images_ms = watch.lapMilliseconds();
    const ImuStatistics imu(problem.imu().between(problem.keyframe(0).t,
                                                  problem.keyframe(problem.keyframeCount() - 1).t));
    if (const auto still = checkImu(problem, imu); !still) return refuse(still.error());

    const size_t n = problem.keyframeCount();
    VisualFrameEstimate estimate;
    estimate.T_VB.assign(n, SE3());
    estimate.v_VB.assign(n, Vector3d::Zero());
    estimate.g_V =
        -problem.gravityMagnitude() * (imu.mean.accel - problem.priors().mean.accel).normalized();
    estimate.bias = {imu.mean.gyro, problem.priors().mean.accel};
    Initialization result = alignWithGravity(problem, estimate);
    result.covariance = covariance(problem, result.states.front().T_WB.R);
    result.timings = {{"images", images_ms}, {"imu", watch.lapMilliseconds()}};
    return result;
  }

 private:
  /** Refuses images that do not stand still. */
  Expected<void> checkImages(const InitializationProblem& problem) const {
    const std::vector<TrackedFrame>& frames = problem.frames();
    const size_t first = problem.keyframeIndices().front();
    const size_t last = problem.keyframeIndices().back();
    double farthest = 0.0;
    for (size_t k = first + 1; k <= last; ++k) {
      std::vector<double> moved = displacements(frames[first], frames[k]);
      if (moved.size() < static_cast<size_t>(min_tracks_))
        return tooFewTracks(frames[first], moved.size(),
                            secondsBetween(frames[first].t, frames[k].t));
      farthest = std::max(farthest, median(std::move(moved)));
    }
    if (!(farthest <= max_displacement_))
      return refuse(RefusalStatus::kTooMuchMotion,
                    "the platform moves: the median landmark has moved by ", Value(farthest, 2),
                    " px, at most ", Bound(max_displacement_, 2), " is standstill");
    return {};
  }

  /** Blames motion if tracks end within the window, unless there were too few to begin with. */
  tl::unexpected<Refusal> tooFewTracks(const TrackedFrame& first, size_t common,
                                       double since) const {
    if (first.observations.size() < static_cast<size_t>(min_tracks_))
      return refuse(RefusalStatus::kTooFewTracks, "the first frame has ",
                    Value(first.observations.size()), " landmarks, at least ", Bound(min_tracks_),
                    " are wanted");
    return refuse(RefusalStatus::kTooMuchMotion, "the platform moves: after ", Number(since, 2),
                  " s ", Value(common), " landmarks of the first frame are left, at least ",
                  Bound(min_tracks_), " are wanted");
  }

  Expected<void> checkImu(const InitializationProblem& problem, const ImuStatistics& imu) const {
    if (!(imu.gyro_std <= max_gyro_std_))
      return refuse(RefusalStatus::kTooMuchMotion, "the platform moves: the gyro varies by ",
                    Value(imu.gyro_std, 3), " rad/s (1 sigma), at most ", Bound(max_gyro_std_, 3),
                    " is standstill");
    if (!(imu.accel_std <= max_accel_std_))
      return refuse(RefusalStatus::kTooMuchMotion,
                    "the platform moves: the accelerometer varies by ", Value(imu.accel_std, 2),
                    " m/s^2 (1 sigma), at most ", Bound(max_accel_std_, 2), " is standstill");
    if (!(imu.mean.gyro.norm() <= max_gyro_mean_))
      return refuse(RefusalStatus::kImplausible, "the mean rate is ",
                    Value(imu.mean.gyro.norm(), 3), " rad/s, at most ", Bound(max_gyro_mean_, 3),
                    " can be a bias");
    const double deviation =
        (imu.mean.accel - problem.priors().mean.accel).norm() - problem.gravityMagnitude();
    if (!(std::abs(deviation) <= max_gravity_deviation_))
      return refuse(RefusalStatus::kImplausible, "the mean specific force is ",
                    deviation > 0.0 ? "+" : "", Value(deviation, 2),
                    " m/s^2 away from gravity, at most ", Bound(max_gravity_deviation_, 2),
                    " is wanted");
    return {};
  }

  /**
   * Covariance of the errors of [b_g, b_a, tilt (2), v], truth against estimate, with
   * R_WB true = Exp(tilt) R_WB. The level part of d = b_a - mean + noise turns the mean specific
   * force, so
   *   tilt = M R_WB d / gravity,   M = [0 -1 0; 1 0 0],
   * and tilt and b_a are one error, not two. What the images show of a turn is in the mean rate.
   */
  Eigen::MatrixXd covariance(const InitializationProblem& problem, const Matrix3d& R_WB) const {
    const TrackedFrame& first = problem.keyframe(0);
    const TrackedFrame& last = problem.keyframe(problem.keyframeCount() - 1);
    const double duration = secondsBetween(first.t, last.t);
    const Vector3d turn = turnBetween(problem.calibration().cameras[0].model, first, last);  // rad
    const double gyro = problem.imuNoise().gyro_noise_density;
    const double accel = problem.imuNoise().accel_noise_density;
    const double prior = problem.priors().sigma_accel_mps2;
    Eigen::Matrix<double, 2, 3> M;
    M << 0, -1, 0, 1, 0, 0;
    const Eigen::Matrix<double, 2, 3> tilt = M * R_WB / problem.gravityMagnitude();
    Eigen::MatrixXd P = Eigen::MatrixXd::Zero(11, 11);
    P.diagonal().segment<3>(0).setConstant(gyro * gyro / duration +
                                           turn.squaredNorm() / (duration * duration));
    P.diagonal().segment<3>(3).setConstant(prior * prior);
    P.block<2, 3>(6, 3) = prior * prior * tilt;
    P.block<3, 2>(3, 6) = P.block<2, 3>(6, 3).transpose();
    P.block<2, 2>(6, 6) = (prior * prior + accel * accel / duration) * tilt * tilt.transpose();
    P.diagonal().segment<3>(8).setConstant(sigma_velocity_ * sigma_velocity_);
    return P;
  }

  double max_displacement_ = 4.0;
  double max_gyro_std_ = 0.1;
  double max_accel_std_ = 1.5;
  double max_gyro_mean_ = 0.3;
  double max_gravity_deviation_ = 0.5;
  int min_tracks_ = 15;
  double sigma_velocity_ = 0.01;
};

IMPLEMENTS_MRPT_OBJECT(Static, Initializer, etalon::plugins)

}  // namespace etalon::plugins

ETALON_REGISTER_INITIALIZER(Static, etalon::plugins, "static", "1.0",
                            "platform at rest: gravity from the accelerometer, gyro bias from the "
                            "mean rate")
