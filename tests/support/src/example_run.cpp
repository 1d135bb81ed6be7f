#include "etalon/testing/example_run.h"

#include <stdlib.h>

#include <stdexcept>

#include "etalon/core/so3.h"

namespace etalon::testing {

static StageRecord exampleStage(const std::string& name, double seed) {
  std::vector<StampedState> states;
  for (int k = 0; k < 3; ++k) {
    StampedState state;
    state.t = kFirstImage + 250'000'000LL * k + 1;
    state.T_WB = SE3(expSO3(Eigen::Vector3d(seed, 0.1 * k, -1.0 / 3.0)),
                     Eigen::Vector3d(k / 3.0, seed, 1e-17));
    state.v_WB = Eigen::Vector3d(0.1 * seed, 1e300, -k / 7.0);
    states.push_back(state);
  }
  const ImuBias bias{Eigen::Vector3d(1e-3, seed, -3e-3), Eigen::Vector3d(0.1, -0.2, seed)};
  StageRecord stage = StageRecord::fromStates(name, std::move(states), bias, 9.81);
  WindowErrors errors;
  errors.keyframes = 3;
  errors.rre_deg = 0.0123 * seed;
  errors.ate_m = 0.00456 * seed;
  errors.gravity_deg = 0.789 * seed;
  errors.velocity_mps = 0.0101 * seed;
  errors.gyro_bias_rps = 0.00112 * seed;
  errors.accel_bias_mps2 = 0.131 * seed;
  // scale_error stays NaN: a short path.
  stage.errors = errors;
  return stage;
}

RunRecord exampleRecord() {
  RunRecord record;
  record.source = "/data/\"V1_02\", medium";
  record.source_kind = "euroc";
  record.initializer = "eta";
  record.initializer_version = "1.2";
  record.initializer_path = "/lib/eta.so";
  record.versions = {{"etalon", "0.1.0"}, {"mrpt", "2.5.8"}};
  record.config = "[pipeline]\ninitializer = eta ; \xC3\xA9\n";
  record.first_image = kFirstImage;
  record.initialized_at = kFirstImage + 500'000'001;

  AttemptRecord refused;
  refused.t = kFirstImage + 250'000'000;
  refused.keyframes = {kFirstImage, kFirstImage + 250'000'000};
  refused.status = "too_few_tracks";
  refused.reason = "12 landmarks, at least 30 are needed";
  refused.reason_value = 12;
  refused.time_offset = RotationTimeOffset{-0.0101, 1.0 / 3000.0, 1.5, 8};
  record.attempts.push_back(refused);

  AttemptRecord accepted;
  accepted.t = kFirstImage + 500'000'001;
  accepted.keyframes = {kFirstImage + 1, kFirstImage + 250'000'001, kFirstImage + 500'000'001};
  accepted.status = kStatusSuccess;
  accepted.timings = {{kTimingStereoOdometry, 12.5}, {kTimingInitialize, 3.25}, {kTimingViBa, 30}};
  const SE3 T_BC(Eigen::Matrix3d::Identity(), {0.1, 0.2, -0.3});  // reads back to the last bit
  accepted.time_offset_used_s = -0.0101;
  accepted.extrinsics = FoundExtrinsics{T_BC, 1.25, 0.05};
  accepted.stages = {exampleStage(kStageInit, 1.1), exampleStage(kStageViBa, 0.7)};
  accepted.stages[1].covariance.resize(2, 2);
  accepted.stages[1].covariance << 1e-6, 2e-7, 3e-7, 1.0 / 3.0;
  accepted.stages[1].covariance_order = "two things";
  record.attempts.push_back(accepted);

  record.statistics.stereo_frames = 11;
  record.statistics.imu_samples = 101;
  record.statistics.unpaired_left = 1;
  record.statistics.unpaired_right = 2;
  record.statistics.unreadable_images = 3;
  record.statistics.frames_not_located = 4;
  record.statistics.input_faults = {{"imu_too_large", 2, kFirstImage, 1e30}};
  record.statistics.duration_s = 0.5;
  record.statistics.frame_median_ms = 8.75;  // wall_s stays NaN
  record.warnings = {"cam0/data.csv:3: a warning"};
  record.ground_truth = GroundTruthUse{11, 10};
  record.trajectory_errors = TrajectoryErrors{{11, 0.01, 0.009, 0.008, 0.02}, {11, 1, 2, 3, 4}};
  record.smoothed_errors = TrajectoryErrors{{11, 0.005, 0.004, 0.003, 0.01}, {11, 0.5, 1, 2, 3}};
  record.final_errors = TrajectoryErrors{{11, 0.004, 0.003, 0.002, 0.009}, {11, 0.4, 1, 2, 3}};
  record.final_ba = FinalBaRecord{8, 300, 4000, 3900, 0.5, 21, "converged", 1.5};
  return record;
}

ExampleRun exampleRun() {
  ExampleRun run;
  run.record = exampleRecord();
  for (CameraCalibration& camera : run.calibration.cameras)
    camera.model = CameraModel("pinhole", "none", 752, 480, {458.0, 458.0, 0.0, 0.0}, {});
  run.calibration.cameras[1].T_BC.t.x() = 0.11;
  for (int i = 0; i < 11; ++i) {
    const TimeNs t = kFirstImage + 50'000'000LL * i;
    const SE3 T_WB(expSO3(Eigen::Vector3d(0.01 * i, 0, 0)), Eigen::Vector3d(0.1 * i, 0, 1));
    const std::string name = std::to_string(t) + ".png";
    run.images.push_back({t, "/data/cam0/" + name, "/data/cam1/" + name});
    FrameEstimate estimate;
    estimate.t = t;
    estimate.nav.T_WB = T_WB;
    run.estimates.push_back(estimate);
  }
  run.images[5].left_path.clear();  // as if embedded: cannot be referenced
  for (int i = -3; i < 15; ++i) {   // reaches beyond the run at both ends
    StampedState state;
    state.t = kFirstImage + 50'000'000LL * i;
    run.ground_truth.states.push_back(state);
  }
  return run;
}

}  // namespace etalon::testing
