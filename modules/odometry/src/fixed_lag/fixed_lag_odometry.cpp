#include "etalon/odometry/fixed_lag/fixed_lag_odometry.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

#include "bias_jump.h"
#include "bridged_imu.h"
#include "calibration/calibration_watch.h"
#include "etalon/core/errors.h"
#include "old_views.h"
#include "rest.h"
#include "sliding.h"
#include "tracks.h"
#include "window_solver.h"

namespace etalon {

using fixed_lag::Matrix15d;
using fixed_lag::MeasuredFrame;
using fixed_lag::WindowState;

void FixedLagOptions::declare(ParameterSet& parameters) {
  parameters.add("recent_frames", &recent_frames, {2, 20},
                 "Newest frames whose velocity and biases are unknowns too.");
  parameters.add("keyframes", &keyframes, {3, 50}, "Older keyframes in the window.");
  parameters.add("iterations", &iterations, {1, 50}, "Gauss-Newton steps per frame, at most.");
  parameters.add("least_sigma_px", &least_sigma_px, {0.001, 100.0},
                 "The standard deviation of a pixel begins at [odometry] sigma_px and follows the "
                 "residuals' median, but not below this, px; at sigma_px or above: it stays.");
  parameters.add("chi2_gate", &chi2_gate, {0.1, 1e9},
                 "An observation whose squared distance from its prediction, in its standard "
                 "deviations with pixels at [odometry] sigma_px, is larger is left out.");
  parameters.add("chi2_outlier", &chi2_outlier, {0.1, 1e9},
                 "An observation whose squared residual (in sigma_px) is larger after the "
                 "optimisation is dropped.");
  parameters.add(
      "chi2_bias_jump", &chi2_bias_jump, {1.0, 1e9},
      "The IMU's biases are estimated anew where six frames running find the same jump of "
      "them, each with a chi-square of at least this (6 degrees of freedom).");
  parameters.add("keyframe_survival", &keyframe_survival, {0.0, 1.0},
                 "A frame becomes a keyframe if a smaller share of its tracks are landmarks.");
  parameters.add("keyframe_parallax_px", &keyframe_parallax_px, {0.1, 1e4},
                 "A frame becomes a keyframe if its median track has moved farther since the last "
                 "keyframe, rotation apart, px.");
}

class FixedLagOdometry::Impl {
  using Matrix6d = Eigen::Matrix<double, 6, 6>;
  /** Over a longer step the error of the attitude, by gravity, moves the predicted position, too. */
  static constexpr double kShortGapS = 0.3;

 public:
  const fixed_lag::Window& window() const { return window_; }
  const StereoInertialCalibration& calibration() const { return calibration_; }
  const fixed_lag::CalibrationWatch& calibrationWatch() const { return calibration_watch_; }

  Impl(const StereoInertialCalibration& calibration, const FixedLagOptions& options,
       const MapOptions& map, std::shared_ptr<ViewMatcher> views)
      : given_(calibration),
        calibration_(calibration),
        options_(options),
        old_views_(calibration_, map, options_.sigma_px, std::move(views)),
        tracks_(calibration_, trackOptions()),
        solver_({options.iterations}),
        bias_jumps_(options_.chi2_bias_jump),
        calibration_watch_(options.calibration) {}

  OdometryOutput start(const OdometryStart& start, const TrackedFrame& frame) {
    calibration_ = given_;
    const bool has_offset = options_.calibration.time_offset != CalibrationMode::kOff;
    fixed_lag::CalibrationVector deviation = fixed_lag::CalibrationVector::Zero();
    deviation[fixed_lag::kTimeOffset] = has_offset ? start.time_offset_s : 0.0;
    calibration_watch_ = fixed_lag::CalibrationWatch(options_.calibration, deviation);
    tracks_ = fixed_lag::Tracks(calibration_, trackOptions());
    rest_ = fixed_lag::RestDetector();
    bias_jumps_ = fixed_lag::BiasJumpDetector(options_.chi2_bias_jump);
    const Eigen::LLT<Matrix15d> factor(start.covariance);
    if (factor.info() != Eigen::Success)
      throw DataError("", 0, "the covariance of the start is not positive definite");
    window_ = fixed_lag::windowAt(calibration_, {0.0, 0.0, -options_.gravity_mps2}, start.state,
                                  frame.t, factor.matrixL().solve(Matrix15d::Identity()));
    if (options_.calibration.any()) addCalibrationColumns(given_, &window_);
    if (!deviation.isZero(0.0)) setCalibration(deviation, &window_);
    const MeasuredFrame measured = fixed_lag::measure(calibration_, frame, options_.sigma_px);
    tracks_.createLandmarks(measured, &window_);
    relative_views_ = fixed_lag::RelativeViews();
    old_views_.begin(&window_);
    located_at_ = frame.t;
    bridged_s_ = 0.0;
    OdometryOutput out;
    out.t = frame.t;
    out.state = start.state;
    out.predicted = start.state;
    out.covariance = covariance_ = start.covariance;
    out.keyframe = true;
    out.observations = frame.observations.size() + frame.right_only.size();
    return out;
  }

  OdometryOutput process(const TrackedFrame& frame, const std::vector<ImuSample>& imu) {
    OdometryOutput out;
    out.t = frame.t;
    const WindowState& last = window_.states.back();
    if (frame.t <= last.t)
      throw DataError("", 0,
                      "frames out of order: stamp " + std::to_string(frame.t) + " ns follows " +
                          std::to_string(last.t) + " ns");
    out.imu_missing = !isComplete(imu, last.t, frame.t, calibration_.imu.rate_hz);
    if (out.imu_missing) bridged_s_ += longestGap(imu, last.t, frame.t);
    const bool last_was_located = last.t == located_at_;
    const bool sees_nothing = frame.observations.empty() && frame.right_only.empty();
    const bool is_blind = sees_nothing || !last_was_located;
    const ImuNoiseDensities noise =
        noiseFor(secondsBetween(is_blind ? located_at_ : last.t, frame.t));
    Preintegration preintegration =
        out.imu_missing ? bridgedImu(last.now, last.t, frame.t, imu, noise, window_.g_W)
                        : Preintegration(imu, last.now.bias, noise);
    const double speed = last.now.v_WB.norm();
    appendState(std::move(preintegration), &window_);
    out.predicted = window_.states.back().now;
    updateImageTimes(&window_);
    window_.states.back().at_rest =
        rest_.atRest(frame, out.imu_missing ? std::vector<ImuSample>() : imu,
                     options_.sigma_px * std::sqrt(window_.pixel_variance), speed);

    const MeasuredFrame measured = fixed_lag::measure(calibration_, frame, options_.sigma_px);
    const bool is_short = last_was_located && secondsBetween(located_at_, frame.t) < kShortGapS;
    const auto counts = tracks_.associate(
        measured, is_short ? predictedPoseCovariance() : covarianceSinceLocated(), &window_);
    const bool keyframe = tracks_.wantsKeyframe(measured, counts, window_);
    window_.states.back().keyframe = keyframe;
    if (keyframe) tracks_.createLandmarks(measured, &window_);
    const bool recalls =
        keyframe && counts.used >= fixed_lag::kLocatedBy && window_.retainedCount() > 0;
    if (recalls) {
      // One step is enough to know where to look.
      solver_.solve(&window_, 1, false);
      old_views_.find(frame, solver_, &window_, &out);
      if (out.recognition) tracks_.turnWorld(out.recognition->T_WW0.R);
    }
    fixed_lag::SolverResult solved = solver_.solve(&window_, options_.iterations, recalls);
    if (bias_jumps_.follow(options_.iterations, &solver_, &window_, &solved))
      out.remarks.emplace_back(
          "images and IMU contradicted each other: the IMU's biases have jumped, and are estimated "
          "anew");
    updateImageTimes(&window_);
    relative_views_.place(window_);
    if (tracks_.dropMisfittingImage(measured, relative_views_, &window_)) {
      solved = solver_.solve(&window_, options_.iterations, true);
      updateImageTimes(&window_);
      relative_views_.place(window_);
    }
    fixed_lag::Tracks::Fit fit = tracks_.dropOutliers(relative_views_, &window_);
    if (options_.least_sigma_px < options_.sigma_px)
      tracks_.followNoise(std::move(fit.squares), &window_);
    // Zero of equations that cannot be solved: the last one is nearer to the truth.
    if (!solved.covariance.isZero(0.0)) covariance_ = solved.covariance;

    if (fit.used >= fixed_lag::kLocatedBy) {
      old_views_.located(located_at_, frame.t);
      located_at_ = frame.t;
      bridged_s_ = 0.0;
    } else {
      out.previous_keyframe = keepLastLocated();
    }
    old_views_.prepare(window_, located_at_);
    WindowState& newest = window_.states.back();  // another window's since the biases jumped
    out.state = newest.now;
    out.covariance = covariance_;
    out.keyframe = newest.keyframe;
    out.observations = frame.observations.size() + frame.right_only.size();
    out.used = fit.used;
    out.gated = counts.gated;
    out.unlocated_s = secondsBetween(located_at_, frame.t);
    out.bridged_s = bridged_s_;
    old_views_.keepNewest(&window_);
    fixed_lag::slide({options_.recent_frames, options_.keyframes, old_views_.options()}, &window_);
    if (out.keyframe) old_views_.dropGone(window_);
    reintegrate();
    if (options_.calibration.any()) calibrate(&out);
    return out;
  }

  void moveWorld(const SE3& T_WW0) {
    fixed_lag::moveWorld(T_WW0, &window_);
    tracks_.turnWorld(T_WW0.R);
    const Matrix15d turn = errorsTurned(T_WW0.R);
    covariance_ = (turn * covariance_ * turn.transpose()).eval();
  }

 private:
  fixed_lag::TrackOptions trackOptions() const {
    return {options_.sigma_px,
            options_.chi2_gate,
            options_.chi2_outlier,
            options_.keyframe_survival,
            options_.keyframe_parallax_px,
            options_.least_sigma_px};
  }

  void calibrate(OdometryOutput* out) {
    const auto deviation = calibration_watch_.update(window_, *out);
    if (deviation && solver_.moveCalibration(*deviation, &window_)) {
      calibration_ = fixed_lag::corrected(given_, *deviation);
      tracks_.forgetPending();
    }
    for (std::string& remark : calibration_watch_.takeRemarks())
      out->remarks.push_back(std::move(remark));
  }

  /** What the last frame with images has seen stays in the window: without it the IMU alone, since
   * the last keyframe, would tie what follows to the landmarks. Returns whether it becomes a
   * keyframe by that. */
  bool keepLastLocated() {
    WindowState& last = window_.states[window_.states.size() - 2];
    if (last.t != located_at_ || last.keyframe) return false;
    return last.keyframe = true;
  }

  /** What a real IMU's scale factors and misalignments do is not in its noise: they err alike for as
   * long as the motion stays alike. Images take it away; without them the densities count twice.
   * @param blind_s for which no image has told anything */
  ImuNoiseDensities noiseFor(double blind_s) const {
    constexpr double kBlindAfterS = 0.4, kFactor = 2.0;
    ImuNoiseDensities noise = options_.imu_noise;
    if (blind_s > kBlindAfterS)
      for (double* density : {&noise.gyro_noise_density, &noise.gyro_random_walk,
                              &noise.accel_noise_density, &noise.accel_random_walk})
        *density *= kFactor;
    return noise;
  }

  /** Covariance of the newest pose relative to the window before its images are used: the noise of
   * the IMU, the error of the velocity, and the error of the window itself. */
  Matrix6d predictedPoseCovariance() const {
    const Preintegration& imu = window_.states.back().imu;
    const Eigen::Matrix3d R = window_.states[window_.states.size() - 2].now.T_WB.R;
    Matrix6d P = errorOfWindow();
    P.topLeftCorner<3, 3>() += imu.covariance().topLeftCorner<3, 3>();
    P.bottomRightCorner<3, 3>() += R * imu.covariance().block<3, 3>(3, 3) * R.transpose() +
                                   imu.dt() * imu.dt() * covariance_.block<3, 3>(6, 6);
    return P;
  }

  /** The same after frames that were not located, by the equations without the newest image: what
   * the IMU alone has gathered since the last one that was. */
  Matrix6d covarianceSinceLocated() {
    const auto located = std::find_if(window_.states.begin(), window_.states.end(),
                                      [this](const WindowState& s) { return s.t == located_at_; });
    if (located == window_.states.end()) return predictedPoseCovariance();
    solver_.solve(&window_, 1, false);
    const WindowState& newest = window_.states.back();
    std::vector<Eigen::Index> unknowns;
    for (const Eigen::Index column : {located->column, newest.column})
      for (Eigen::Index c = 0; c < 6; ++c) unknowns.push_back(column + c);
    const Eigen::MatrixXd joint = solver_.covariance(unknowns);
    if (joint.size() == 0) return predictedPoseCovariance();
    Matrix6d turn = Matrix6d::Identity();  // the position from the axes of the located pose to W
    turn.bottomRightCorner<3, 3>() = located->now.T_WB.R;
    return errorOfWindow() +
           turn * fixed_lag::relativeCovariance(located->now.T_WB, newest.now.T_WB, joint) *
               turn.transpose();
  }

  static Matrix6d errorOfWindow() {
    Matrix6d P = Matrix6d::Zero();
    P.diagonal().head<3>().setConstant(std::pow(5e-4, 2));  // rad
    P.diagonal().tail<3>().setConstant(std::pow(2e-3, 2));  // m
    return P;
  }

  /** Integrates the raw samples anew where the bias has moved so far that the first-order
   * correction is off by a tenth of a per mille of the rate. */
  void reintegrate() {
    for (size_t i = window_.firstFull() + 1; i < window_.states.size(); ++i) {
      WindowState& state = window_.states[i];
      const ImuBias& bias = window_.states[i - 1].now.bias;
      if ((state.imu.bias().gyro - bias.gyro).norm() < 0.01 &&
          (state.imu.bias().accel - bias.accel).norm() < 0.1)
        continue;
      state.imu = state.imu.reintegrated(bias);
      state.imu_sqrt_information = inertialSqrtInformation(state.imu);
    }
  }

  StereoInertialCalibration given_;
  StereoInertialCalibration calibration_;  ///< in use
  FixedLagOptions options_;
  fixed_lag::OldViews old_views_;
  fixed_lag::Tracks tracks_;
  fixed_lag::WindowSolver solver_;
  fixed_lag::RestDetector rest_;
  fixed_lag::BiasJumpDetector bias_jumps_;
  fixed_lag::CalibrationWatch calibration_watch_;
  fixed_lag::Window window_;
  fixed_lag::RelativeViews relative_views_;  ///< at the estimates of the last optimisation
  TimeNs located_at_ = 0;
  double bridged_s_ = 0.0;  ///< since then, without IMU
  Matrix15d covariance_ = Matrix15d::Zero();
};

FixedLagOdometry::FixedLagOdometry(const StereoInertialCalibration& calibration,
                                   const FixedLagOptions& options)
    : FixedLagOdometry(calibration, options, {}, nullptr) {}

FixedLagOdometry::FixedLagOdometry(const StereoInertialCalibration& calibration,
                                   const FixedLagOptions& options, const MapOptions& map,
                                   std::shared_ptr<ViewMatcher> views)
    : impl_(std::make_unique<Impl>(calibration, options, map, std::move(views))) {}

FixedLagOdometry::~FixedLagOdometry() = default;

OdometryOutput FixedLagOdometry::start(const OdometryStart& start, const TrackedFrame& frame) {
  return impl_->start(start, frame);
}

OdometryOutput FixedLagOdometry::process(const TrackedFrame& frame,
                                         const std::vector<ImuSample>& imu) {
  return impl_->process(frame, imu);
}

bool FixedLagOdometry::moveWorld(const SE3& T_WW0) {
  impl_->moveWorld(T_WW0);
  return true;
}

Trajectory FixedLagOdometry::keyframes() const {
  Trajectory keyframes;
  for (const fixed_lag::WindowState& state : impl_->window().states)
    if (state.keyframe) keyframes.push_back({state.t, state.now.T_WB});
  return keyframes;
}

Trajectory FixedLagOdometry::seenFrom() const {
  Trajectory images;
  for (const fixed_lag::WindowState& state : impl_->window().states)
    if (state.keyframe) images.push_back({state.t, state.seenFrom()});
  return images;
}

std::vector<CalibrationFinding> FixedLagOdometry::calibrationFindings() const {
  return impl_->calibrationWatch().findings();
}

std::optional<StereoInertialCalibration> FixedLagOdometry::calibrationInUse() const {
  return impl_->calibration();
}

std::map<LandmarkId, Eigen::Vector3d> FixedLagOdometry::landmarks() const {
  std::map<LandmarkId, Eigen::Vector3d> landmarks;
  const fixed_lag::Window& window = impl_->window();
  for (const auto& [id, landmark] : window.landmarks)
    landmarks[id] = window.states[landmark.host].seenFrom() * landmark.in_host.position();
  return landmarks;
}

}  // namespace etalon
