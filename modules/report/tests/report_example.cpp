#include "report_example.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <random>

#include "etalon/core/so3.h"

namespace etalon::testing {
namespace {

constexpr TimeNs kExampleStart = 1403636579763555584;

TimeNs nanoseconds(double seconds) { return static_cast<TimeNs>(std::llround(1e9 * seconds)); }

/** A flight: loops of some metres, at rest for the first three seconds. */
StampedState truthAt(double t_s, int sequence) {
  const double s = std::max(0.0, t_s - 3.0), turn = 0.25 + 0.05 * sequence;
  StampedState state;
  state.t = kExampleStart + nanoseconds(t_s);
  state.T_WB.t = Eigen::Vector3d(3.0 * std::sin(turn * s), 2.0 * std::sin(1.7 * turn * s),
                                 1.0 + 0.4 * std::sin(2.3 * turn * s));
  state.T_WB.R = expSO3(Eigen::Vector3d(0, 0, turn * s));
  if (s > 0)
    state.v_WB = turn * Eigen::Vector3d(3.0 * std::cos(turn * s), 3.4 * std::cos(1.7 * turn * s),
                                        0.92 * std::cos(2.3 * turn * s));
  return state;
}

class Maker {
 public:
  /** Log-normal around `median`. */
  double about(double median, double spread = 0.6) {
    return median * std::exp(spread * normal_(random_));
  }
  bool chance(double probability) {
    return std::uniform_real_distribution<double>(0.0, 1.0)(random_) < probability;
  }

  StageRecord stage(const std::string& name, const std::vector<StampedState>& truth, double size,
                    bool with_errors) {
    StageRecord stage;
    stage.stage = name;
    const SE3 T_VW(expSO3(Eigen::Vector3d(0, 0, 1.0)), Eigen::Vector3d(1, 2, 3));
    for (const StampedState& state : truth) {
      const Eigen::Vector3d noise(normal_(random_), normal_(random_), normal_(random_));
      StampedState keyframe{state.t, T_VW * state.T_WB, state.v_WB};
      keyframe.T_WB.t += 0.01 * size * noise;
      stage.states.push_back(keyframe);
    }
    if (!with_errors) return stage;
    WindowErrors errors;
    errors.keyframes = truth.size();
    errors.rre_deg = about(0.03 * size);
    errors.ate_m = about(0.008 * size);
    errors.ate_yaw_m = 1.2 * errors.ate_m;
    errors.gravity_deg = about(0.6 * size);
    errors.gravity_corrected_deg = about(0.5 * size);
    errors.velocity_mps = about(0.02 * size);
    // A covariance that claims half of the median error: some are far outside.
    errors.tilt_nees = 0.5 * std::pow(errors.gravity_deg / (0.3 * size), 2.0);
    errors.velocity_nees = std::pow(errors.velocity_mps / (0.01 * size), 2.0) / 3.0;
    errors.gyro_bias_rps = about(0.002 * size);
    errors.accel_bias_mps2 = about(0.1 * size);
    if ((truth.front().T_WB.t - truth.back().T_WB.t).norm() > kMinPathForScale)
      errors.scale_error = about(0.01 * size);
    stage.errors = errors;
    return stage;
  }

  /** One attempt by initializer number `method`; its errors grow with `hardness`. */
  AttemptRecord attempt(const std::vector<StampedState>& truth, int method, double hardness,
                        bool with_errors) {
    AttemptRecord attempt;
    for (const StampedState& state : truth) attempt.keyframes.push_back(state.t);
    attempt.t = truth.back().t;
    attempt.timings = {{kTimingStereoOdometry, about(12.0, 0.2)},
                       {kTimingInitialize, about(0.5 * std::pow(1.9, method), 0.3)}};
    if (chance(0.25 * hardness)) {
      attempt.status = chance(0.5) ? "too_little_motion" : "ill_conditioned";
      attempt.reason_value = about(0.01);
      attempt.reason = "mean acceleration differs from gravity by " +
                       std::to_string(attempt.reason_value) + " m/s^2, at least 0.25 is needed";
      return attempt;
    }
    const double size = hardness * (0.5 + 0.3 * method);
    attempt.stages.push_back(stage(kStageInit, truth, size, with_errors));
    attempt.stages.push_back(stage(kStageViBa, truth, 0.4 * size, with_errors));
    attempt.timings.push_back({kTimingViBa, about(18.0, 0.2)});
    attempt.timings.push_back({"gyro_bias", about(0.2, 0.2)});
    attempt.status = kStatusSuccess;
    if (chance(0.06 * hardness)) {
      attempt.status = "implausible";
      attempt.reason = "accelerometer bias of 1.21 m/s^2, at most 1 is plausible";
    }
    return attempt;
  }

 private:
  std::mt19937 random_{7};
  std::normal_distribution<double> normal_;
};

std::vector<StampedState> windowAt(double start_s, int keyframes, double rate_hz, int sequence) {
  std::vector<StampedState> truth;
  for (int k = 0; k < keyframes; ++k) truth.push_back(truthAt(start_s + k / rate_hz, sequence));
  return truth;
}

constexpr std::array<const char*, 7> kInitializers = {
    "eta",         "orbslam3_inertial_only", "stereo_nec",
    "closed_form", "vins_alignment",         "drt_loose",
    "mean_gravity"};
constexpr std::array<const char*, 7> kSequences = {
    "MH_01_easy",   "MH_03_medium",    "V1_01_easy",    "V1_02_medium",
    "V2_02_medium", "no_ground_truth", "cannot_be_read"};

BenchmarkSequence sequenceOf(int s, const ReportExampleSize& size) {
  BenchmarkSequence sequence;
  sequence.name = kSequences[s % kSequences.size()];
  sequence.source = "/recordings/" + sequence.name;
  sequence.source_kind = "euroc";
  sequence.first_image = kExampleStart;
  sequence.duration_s = 2.5 * size.windows;
  sequence.last_image = kExampleStart + nanoseconds(sequence.duration_s);
  sequence.stereo_frames = 50 * size.windows;
  sequence.has_ground_truth = s % 7 < 5;
  if (sequence.has_ground_truth) {
    sequence.ground_truth_check.interval_s = 0.25;
    sequence.ground_truth_check.rre_deg = 0.005 + 0.01 * s;
    sequence.ground_truth_check.world_tilt_deg = 0.1 * s;
  }
  sequence.frontend_ms = 9.5 + s;
  if (s % 7 == 6) sequence.error = "cam1/data.csv:17: expected 2 fields, there are 1";
  return sequence;
}

}  // namespace

BenchmarkRecord reportExample(const ReportExampleSize& size) {
  BenchmarkRecord record;
  record.protocol.keyframes = size.keyframes;
  record.protocol.rates_hz = size.rates_hz;
  record.versions = {{"etalon", "0.1.0"}, {"ceres", "2.1.0"}, {"mrpt", "2.5.8"}};
  record.config = "[pipeline]\nkeyframes = 10 ; of a window\n";
  for (int i = 0; i < size.initializers; ++i) {
    BenchmarkInitializer initializer;
    initializer.name = kInitializers[i];
    initializer.version = "1." + std::to_string(i);
    initializer.config = "[" + initializer.name + "]\n";
    record.initializers.push_back(initializer);
  }
  Maker maker;
  for (int s = 0; s < size.sequences; ++s) {
    const BenchmarkSequence sequence = sequenceOf(s, size);
    record.sequences.push_back(sequence);
    if (!sequence.error.empty()) continue;
    for (const int keyframes : size.keyframes)
      for (const double rate_hz : size.rates_hz)
        for (int window = 0; window < size.windows; ++window)
          for (int i = 0; i < size.initializers; ++i) {
            WindowResult result;
            result.sequence = sequence.name;
            result.window = window;
            result.keyframes = keyframes;
            result.rate_hz = rate_hz;
            result.initializer = record.initializers[i].name;
            const auto truth = windowAt(2.5 * window, keyframes, rate_hz, s);
            result.t0 = truth.front().t;
            const double short_window = 1.0 + 1.0 / (keyframes / rate_hz);
            const double stretch =
                window < 2 ? 6.0 : 1.0 + std::max(0.0, std::sin(0.2 * window + s));
            result.attempt =
                maker.attempt(truth, i, 0.6 * stretch * short_window, sequence.has_ground_truth);
            if (sequence.has_ground_truth) result.truth = truth;
            if (result.attempt.stage(kStageViBa) != nullptr)
              result.noise = NoiseCheck{{maker.about(25.0), 27.0},
                                        {maker.about(20.0), 27.0},
                                        {maker.about(900.0, 0.2), 800.0}};
            record.results.push_back(result);
          }
  }
  return record;
}

RunExample runExample() {
  RunExample run;
  Maker maker;
  RunRecord& record = run.record;
  record.source = "/recordings/MH_01_easy";
  record.source_kind = "euroc";
  record.initializer = "eta";
  record.initializer_version = "1.0";
  record.versions = {{"etalon", "0.1.0"}};
  record.config = "[pipeline]\ninitializer = eta\n";
  record.first_image = kExampleStart;
  record.statistics.duration_s = 40.0;
  record.statistics.stereo_frames = 801;
  for (int a = 0; a < 12; ++a) {
    const auto truth = windowAt(0.25 * a, 10, 4.0, 0);
    AttemptRecord attempt = maker.attempt(truth, 0, a < 11 ? 4.0 : 0.5, true);
    if (a < 11 && attempt.accepted()) attempt = maker.attempt(truth, 0, 1e3, true);
    record.attempts.push_back(attempt);
    if (!attempt.accepted()) continue;
    record.initialized_at = attempt.t;
    break;
  }
  run.ground_truth.has_velocity = run.ground_truth.has_biases = true;
  for (int i = 0; i <= 8000; ++i) run.ground_truth.states.push_back(truthAt(0.005 * i, 0));
  const auto at = [](double seconds) { return kExampleStart + durationNs(seconds); };
  record.events = {{at(0.0), "visual", "images have come", false, {}},
                   {*record.initialized_at, "inertial", "'eta' was accepted", false, {}},
                   {at(20.0), "dead_reckoning", "no image <came>", false, {}},
                   {at(21.0), "inertial", "images are back", false, {}},
                   {at(30.0), "inertial", "the IMU had a gap", true, {}}};
  record.statistics.stages = {{"front_end", 801, 5.0, 8.0, 12.0, 4.0},
                              {"odometry", 801, 2.0, 3.0, 5.0, 1.6}};
  const SE3 T_VW(expSO3(Eigen::Vector3d(0, 0, 0.7)), Eigen::Vector3d(4, 5, 6));
  int start = -1;  // the first frame that is inertial
  for (int i = 0; i <= 800; ++i) {
    const StampedState truth = truthAt(0.05 * i, 0);
    FrameEstimate e;
    e.t = truth.t;
    e.nav.T_WB = T_VW * truth.T_WB;
    if (truth.t >= *record.initialized_at) {
      if (start < 0) start = i;
      e.state = i >= 400 && i < 420 ? PipelineState::kDeadReckoning : PipelineState::kInertial;
      const double sigma = 1e-4 * (i - start);  // m an axis
      e.nav.T_WB.t.x() += 2.0 / std::sqrt(3.0) * sigma;
      e.nav.v_WB = T_VW.R * truth.v_WB + Eigen::Vector3d(0.01, 0.0, 0.0);
      e.nav.bias = truth.bias;
      e.pose_covariance.setIdentity();
      e.pose_covariance *= sigma * sigma;
      e.motion_variance.setConstant(3e-4);
    }
    run.estimates.push_back(e);
  }
  return run;
}

}  // namespace etalon::testing
