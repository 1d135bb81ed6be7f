#include <algorithm>
#include <limits>

#include "check_tools.h"

namespace etalon::contract {

namespace {

/** What an answer to a bad window may be. */
enum class Allowed {
  kRefusal,         ///< nothing else
  kRightOrRefusal,  ///< a success only if the evaluation would call it one
  kNearOrRefusal,   ///< a success only within five times that: VI-BA converges from there
};

/** Bad windows, one after the other. */
class BadWindows {
 public:
  explicit BadWindows(const Initializer& initializer) : initializer_(initializer) {}

  void add(const std::string& what, const Trial& trial, Allowed allowed) {
    addProblem(what, trial.problem(), trial, allowed);
  }

  void addProblem(const std::string& what, const InitializationProblem& problem, const Trial& trial,
                  Allowed allowed) {
    const Answer answer = ask(initializer_, problem);
    if (!answer.broken.empty()) {
      complaints_.add(what, answer.broken);
    } else if (!answer.result) {
      ++refused_;
      last_refusal_ = what + ": " + refused(answer.result.error()).detail;
    } else if (allowed == Allowed::kRefusal) {
      complaints_.add(what, "is called a success");
    } else {
      judge(what, *answer.result, trial.window, allowed == Allowed::kNearOrRefusal ? 5.0 : 1.0);
    }
  }

  ContractCheck verdict() const {
    if (!complaints_.empty()) return complaints_.verdict();
    if (right_ == 0) return passed(format("%d refused; ", refused_) + last_refusal_, refused_);
    return passed(format("%d refused, %d solved, gravity within %.2f deg, velocity within %.3f m/s",
                         refused_, right_, worst_gravity_, worst_velocity_),
                  refused_);
  }

 private:
  void judge(const std::string& what, const Initialization& result, const SyntheticWindow& window,
             double factor) {
    const WindowErrors errors = errorsOf(result.states, result.bias, window);
    // What the evaluation calls a success.
    const double gravity_deg = factor * 2.0, velocity_mps = factor * 0.1;
    if (!(errors.gravity_deg < gravity_deg && errors.velocity_mps < velocity_mps)) {
      const double severity =
          std::max(errors.gravity_deg / gravity_deg, errors.velocity_mps / velocity_mps);
      complaints_.add(what,
                      format("is called a success with gravity off by %.2f deg and velocity by "
                             "%.3f m/s (%.0f deg and %.1f m/s are allowed)",
                             errors.gravity_deg, errors.velocity_mps, gravity_deg, velocity_mps) +
                          hintAtCause(result, window),
                      severity);
      return;
    }
    ++right_;
    worst_gravity_ = std::max(worst_gravity_, errors.gravity_deg);
    worst_velocity_ = std::max(worst_velocity_, errors.velocity_mps);
  }

  const Initializer& initializer_;
  int refused_ = 0, right_ = 0;
  double worst_gravity_ = 0.0, worst_velocity_ = 0.0;
  Complaints complaints_;
  std::string last_refusal_;
};

/** Windows with and without motion, so that methods for either are asked. */
constexpr Motion kMovingAndStill[] = {Motion::kGentle, Motion::kStandstill};

/** Keeps the first `count` keyframes and the frames up to the last of them. */
void keepKeyframes(SyntheticWindow* window, size_t count) {
  window->keyframe_indices.resize(count);
  window->truth.resize(count);
  window->frames.resize(count == 0 ? 0 : window->keyframe_indices.back() + 1);
}

ContractCheck fewKeyframes(const Initializer& initializer, const ContractOptions&) {
  BadWindows windows(initializer);
  for (const Motion motion : kMovingAndStill) {
    for (const size_t count : {0U, 1U, 2U, 3U, 4U}) {
      SyntheticWindowOptions options;
      options.motion = motion;
      Trial trial(options);
      keepKeyframes(&trial.window, count);
      windows.add(format("%zu keyframes, %s", count, toString(motion)), trial,
                  count < 2 ? Allowed::kRefusal : Allowed::kRightOrRefusal);
    }
  }
  return windows.verdict();
}

ContractCheck fewTracks(const Initializer& initializer, const ContractOptions&) {
  BadWindows windows(initializer);
  for (const Motion motion : kMovingAndStill) {
    for (const size_t count : {0U, 1U, 2U, 5U, 12U}) {
      SyntheticWindowOptions options;
      options.motion = motion;
      Trial trial(options);
      for (TrackedFrame& frame : trial.window.frames)
        frame.observations.resize(std::min(count, frame.observations.size()));
      windows.add(format("%zu tracks, %s", count, toString(motion)), trial,
                  Allowed::kRightOrRefusal);
    }
  }
  return windows.verdict();
}

/** Tracks that break off: no landmark is seen twice; no landmark is seen by the right camera; one
 * keyframe sees nothing. */
ContractCheck brokenTracks(const Initializer& initializer, const ContractOptions&) {
  BadWindows windows(initializer);
  for (const Motion motion : kMovingAndStill) {
    const std::string where = std::string(", ") + toString(motion);
    SyntheticWindowOptions options;
    options.motion = motion;
    Trial unrelated(options), left_only(options), blind(options);
    LandmarkId id = 0;
    for (TrackedFrame& frame : unrelated.window.frames)
      for (Observation& o : frame.observations) o.id = id++;
    for (TrackedFrame& frame : left_only.window.frames)
      for (Observation& o : frame.observations) o.has_right = false;
    blind.window.frames[blind.window.keyframe_indices[4]].observations.clear();
    windows.add("no landmark seen twice" + where, unrelated, Allowed::kRightOrRefusal);
    windows.add("no right observations" + where, left_only, Allowed::kRightOrRefusal);
    windows.add("a keyframe without observations" + where, blind, Allowed::kRightOrRefusal);
  }
  return windows.verdict();
}

/** Drops the samples of (from_s, to_s) after the window's start. */
void dropImu(Trial* trial, double from_s, double to_s) {
  std::vector<ImuSample> kept;
  for (const ImuSample& sample : trial->window.imu.samples()) {
    const double t = secondsBetween(trial->options.start, sample.t);
    if (t <= from_s || t >= to_s) kept.push_back(sample);
  }
  trial->window.imu = ImuBuffer(kept);
}

ContractCheck emptyImu(const Initializer& initializer, const ContractOptions&) {
  BadWindows windows(initializer);
  Trial none{SyntheticWindowOptions()}, interval = none, end = none, start = none;
  none.window.imu = ImuBuffer();
  dropImu(&interval, 0.75, 1.0);
  dropImu(&end, 1.9, 100.0);
  dropImu(&start, -1.0, 0.1);
  windows.add("no IMU at all", none, Allowed::kRefusal);
  windows.add("nothing between two keyframes", interval, Allowed::kRefusal);
  windows.add("the IMU ends early", end, Allowed::kRefusal);
  windows.add("the IMU starts late", start, Allowed::kRefusal);
  return windows.verdict();
}

ContractCheck imuGap(const Initializer& initializer, const ContractOptions&) {
  BadWindows windows(initializer);
  for (const Motion motion : kMovingAndStill) {
    SyntheticWindowOptions options;
    options.motion = motion;
    Trial large(options), small(options);
    dropImu(&large, 0.9, 1.1);
    dropImu(&small, 1.0, 1.015);  // two samples: what a host bridges
    windows.add("a gap of 0.2 s", large, Allowed::kRefusal);
    windows.add("two samples lost", small, Allowed::kRightOrRefusal);
  }
  return windows.verdict();
}

ContractCheck notFinite(const Initializer& initializer, const ContractOptions&) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const double infinity = std::numeric_limits<double>::infinity();
  const Trial good{SyntheticWindowOptions()};
  BadWindows windows(initializer);
  for (const double value : {nan, infinity}) {
    Trial left = good, right = good, gyro = good, accel = good;
    left.window.frames[3].observations[2].left.x() = value;
    Observation& o = right.window.frames[5].observations[1];
    o.has_right = true;
    o.right.y() = value;
    std::vector<ImuSample> samples = good.window.imu.samples();
    samples[100].gyro.z() = value;
    gyro.window.imu = ImuBuffer(samples);
    samples = good.window.imu.samples();
    samples[200].accel.x() = value;
    accel.window.imu = ImuBuffer(samples);
    windows.add(format("%g in a left pixel", value), left, Allowed::kRefusal);
    windows.add(format("%g in a right pixel", value), right, Allowed::kRefusal);
    windows.add(format("%g in the gyro", value), gyro, Allowed::kRefusal);
    windows.add(format("%g in the accelerometer", value), accel, Allowed::kRefusal);
  }
  return windows.verdict();
}

/** Finite, but nothing that a camera or an IMU could mean. */
ContractCheck absurdValues(const Initializer& initializer, const ContractOptions&) {
  const Trial good{SyntheticWindowOptions()};
  Trial pixels = good, one_pixel = good, fast = good, weightless = good;
  for (TrackedFrame& frame : pixels.window.frames)
    for (Observation& o : frame.observations) o.left *= 1e6;
  for (TrackedFrame& frame : one_pixel.window.frames)
    for (Observation& o : frame.observations) o.left = o.right = {300.0, 200.0};
  std::vector<ImuSample> samples = good.window.imu.samples();
  for (ImuSample& s : samples) s.gyro *= 1e4;
  fast.window.imu = ImuBuffer(samples);
  samples = good.window.imu.samples();
  for (ImuSample& s : samples) s.accel.setZero();
  weightless.window.imu = ImuBuffer(samples);
  BadWindows windows(initializer);
  windows.add("pixels far outside the image", pixels, Allowed::kRightOrRefusal);
  windows.add("all landmarks in one pixel", one_pixel, Allowed::kRightOrRefusal);
  windows.add("a gyro ten thousand times too large", fast, Allowed::kRefusal);
  windows.add("an accelerometer that measures nothing", weightless, Allowed::kRefusal);
  return windows.verdict();
}

ContractCheck outliers(const Initializer& initializer, const ContractOptions&) {
  BadWindows windows(initializer);
  for (const Motion motion : {Motion::kGentle, Motion::kAggressive, Motion::kStandstill}) {
    for (unsigned seed = 1; seed <= 5; ++seed) {
      SyntheticWindowOptions options = noisyOptions(motion, seed);
      options.outlier_share = 0.3;
      windows.add(format("%s, seed %u", toString(motion), seed), Trial(options),
                  Allowed::kNearOrRefusal);
    }
  }
  return windows.verdict();
}

/** Stereo odometry locates no keyframe but the first. */
ContractCheck noStereoOdometry(const Initializer& initializer, const ContractOptions&) {
  const Trial trial{SyntheticWindowOptions()};
  InitializationProblem::Data data = trial.problem().data();
  data.odometry.min_pose_inliers = std::numeric_limits<int>::max();
  const InitializationProblem lost(std::move(data));
  const Allowed allowed =
      initializer.needsVisualSolution() ? Allowed::kRefusal : Allowed::kRightOrRefusal;
  BadWindows windows(initializer);
  windows.addProblem("stereo odometry has lost its way", lost, trial, allowed);
  return windows.verdict();
}

}  // namespace

std::vector<CheckEntry> robustnessChecks() {
  return {
      {{"status.few_keyframes", "0 to 4 keyframes: refused, or right."}, fewKeyframes},
      {{"status.few_tracks", "0 to 12 tracks a frame: refused, or right."}, fewTracks},
      {{"status.broken_tracks",
        "No landmark twice, none in the right image, a blind keyframe: refused, or right."},
       brokenTracks},
      {{"status.empty_imu", "No IMU, or none in a part of the window: refused."}, emptyImu},
      {{"status.imu_gap", "A gap of 0.2 s: refused; two lost samples: refused, or right."}, imuGap},
      {{"status.not_finite", "NaN or infinity in a measurement: refused."}, notFinite},
      {{"status.absurd_values", "Finite nonsense in pixels and IMU: refused."}, absurdValues},
      {{"status.outliers", "30 % of the pixels wrong: refused, or near enough for VI-BA."},
       outliers},
      {{"status.no_step_one", "Stereo odometry fails: refused, unless it is not needed."},
       noStereoOdometry}};
}

}  // namespace etalon::contract
