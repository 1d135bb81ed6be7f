#include "etalon/pipeline/pipeline.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "etalon/core/so3.h"
#include "scripted_flight.h"

namespace etalon::pipeline_test {

namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;
using ::testing::HasSubstr;

constexpr double kDegree = M_PI / 180.0;
constexpr int kWindowKeyframes = 3;  // keyframes

class PipelineWithAuto : public ::testing::Test {
 protected:
  static const Flight& flight() { return Flight::instance(); }

  static PipelineOptions options() {
    PipelineOptions o;
    o.keyframes = kWindowKeyframes;
    o.keyframe_rate_hz = kFrameRateHz;
    o.odometry_kind = kStereoVisual;
    o.window.refine = false;  // what the scripts say counts as it is
    return o;
  }

  /** Stereo odometry of the problem in the world A, T_AW from the true one; landmarks moved by
   * `shift`. */
  static InitializationResult visualSolutionIn(const InitializationProblem& problem,
                                               const SE3& T_AW, const ImuBias& bias,
                                               const Vector3d& shift = Vector3d::Zero()) {
    const VisualSolution& visual = problem.visualSolution().value();
    const SE3 T_AV = T_AW * flight().truth(problem.keyframe(0).t) * visual.T_VB[0].inverse();
    Initialization result;
    for (int k = 0; k < problem.keyframeCount(); ++k)
      result.states.push_back({problem.keyframe(k).t, T_AV * visual.T_VB[k], Vector3d::Zero()});
    for (const auto& [id, p_V] : visual.landmarks) result.landmarks[id] = T_AV * p_V + shift;
    result.bias = bias;
    result.covariance = Eigen::MatrixXd::Identity(11, 11) * kSigmaBias * kSigmaBias;
    return result;
  }

  static InitializationResult moves() { return refuse(RefusalStatus::kTooMuchMotion, "it moves"); }
  static InitializationResult gap() { return refuse(RefusalStatus::kImuGap, "a gap in the IMU"); }

  /** At rest, the n-th call gives the n-th answer; the last one from then on. */
  static Script answers(std::vector<Script> scripts) {
    auto calls = std::make_shared<size_t>(0);
    return [calls, scripts](const InitializationProblem& problem) {
      return scripts[std::min((*calls)++, scripts.size() - 1)](problem);
    };
  }
  static Script rests() {
    return [](const InitializationProblem& problem) {
      return visualSolutionIn(problem, SE3(), biasAtRest());
    };
  }
  static Script says(const InitializationResult& result) {
    return [result](const InitializationProblem& /*problem*/) { return result; };
  }

  static ImuBias biasAtRest() { return {Vector3d(1e-3, -2e-3, 3e-3), Vector3d::Zero()}; }
  static ImuBias biasInMotion() {
    return {Vector3d(4e-3, 5e-3, -6e-3), Vector3d(0.01, 0.02, -0.03)};
  }

  static Pipeline pipeline(const PipelineOptions& options, Script at_rest, Script moving) {
    PipelineInitializers initializers;
    initializers.name = "moving";
    initializers.initializer = std::make_shared<Scripted>(std::move(moving));
    initializers.at_rest = std::make_shared<Scripted>(std::move(at_rest));
    initializers.at_rest_name = "at_rest";
    return {flight().calibration, options, initializers};
  }

  /** Adds the frames [first, last) with the IMU up to each of them. */
  static void add(Pipeline* pipeline, size_t first, size_t last) {
    for (size_t k = first; k < last; ++k) {
      const TimeNs after = k > 0 ? flight().frames[k - 1].t : flight().imu.front().t - 1;
      for (const ImuSample& sample : flight().imu)
        if (sample.t > after && sample.t <= flight().frames[k].t) pipeline->add(sample);
      pipeline->add(flight().frames[k]);
    }
  }

  static constexpr double kSigmaBias = 1e-4;  // rad/s
};

TEST_F(PipelineWithAuto, StampsStayAsTheyCame) {
  Pipeline keeping = pipeline(options(), rests(), says(moves()));
  std::vector<TimeNs> stamps;
  for (const ImuSample& sample : flight().imu) keeping.add(sample);
  for (StereoFrame frame : flight().frames) {
    frame.t += 37;  // not on MRPT's tick of 100 ns
    stamps.push_back(frame.t);
    keeping.add(frame);
  }
  keeping.finish();
  ASSERT_EQ(keeping.trajectory().size(), stamps.size());
  for (size_t i = 0; i < stamps.size(); ++i) EXPECT_EQ(keeping.trajectory()[i].t, stamps[i]);
  ASSERT_FALSE(keeping.attempts().empty());
  EXPECT_EQ(keeping.attempts()[0].keyframes[0], stamps[0]);
}

TEST_F(PipelineWithAuto, AWindowsOwnSamplesSayWhetherItVibrates) {
  const auto believed = [](double vibration_mps2) {
    ImuNoiseDensities noise;
    Pipeline pipeline = PipelineWithAuto::pipeline(
        options(),
        [&noise](const InitializationProblem& problem) {
          noise = problem.imuNoise();
          return moves();
        },
        says(moves()));
    double sign = 1.0;
    for (ImuSample sample : flight().imu) {
      sample.accel.x() += vibration_mps2 * (sign = -sign);
      pipeline.add(sample);
    }
    for (const StereoFrame& frame : flight().frames) pipeline.add(frame);
    pipeline.finish();
    return noise.accel_noise_density / flight().calibration.imu.noise.accel_noise_density;
  };
  EXPECT_DOUBLE_EQ(believed(0.0), options().imu_noise.min_accel_noise_factor);
  EXPECT_DOUBLE_EQ(believed(1.0), options().imu_noise.accel_noise_factor);
}

TEST_F(PipelineWithAuto, HandoverKeepsYawAndPositionAndTakesTheRest) {
  // The second world: turned by 40 degrees of yaw, tilted by 1 degree, moved.
  const SE3 T_AW(expSO3(Vector3d(0, 0, -40 * kDegree)) * expSO3(Vector3d(kDegree, 0, 0)),
                 Vector3d(3, -2, 1));
  const Vector3d shift(0, 0, 1e-3);
  InitializationResult reported;
  Pipeline pipeline =
      this->pipeline(options(), answers({rests(), says(moves())}),
                     [&reported, &T_AW, &shift](const InitializationProblem& problem) {
                       return reported = visualSolutionIn(problem, T_AW, biasInMotion(), shift);
                     });
  add(&pipeline, 0, kWindowKeyframes);
  ASSERT_TRUE(pipeline.initializedAt());
  EXPECT_TRUE(pipeline.waitsForMotion());
  EXPECT_EQ(pipeline.bias().gyro, biasAtRest().gyro);
  EXPECT_FALSE(pipeline.handedOverAt());
  const Trajectory before = pipeline.trajectory();

  add(&pipeline, kWindowKeyframes, kWindowKeyframes + 1);
  const TimeNs now = flight().frames[kWindowKeyframes].t;
  ASSERT_EQ(pipeline.handedOverAt(), now);
  EXPECT_FALSE(pipeline.waitsForMotion());
  EXPECT_EQ(pipeline.initializedAt(), before.back().t);
  EXPECT_EQ(pipeline.bias().gyro, biasInMotion().gyro);
  EXPECT_EQ(pipeline.bias().accel, biasInMotion().accel);

  // Poses before stay as they were.
  const Trajectory after = pipeline.trajectory();
  ASSERT_EQ(after.size(), before.size() + 1);
  for (size_t k = 0; k < before.size(); ++k) {
    EXPECT_EQ(after[k].T_WB.R, before[k].T_WB.R);
    EXPECT_EQ(after[k].T_WB.t, before[k].T_WB.t);
  }

  // Position and yaw go on; the change of attitude is the tilt, about a level axis. Stereo odometry
  // runs through the window again, from its first keyframe and among the landmarks reported, which
  // are a millimetre off: so is it.
  const SE3 T_WB = after.back().T_WB;
  const SE3 on =
      before.back().T_WB * (flight().truth(before.back().t).inverse() * flight().truth(now));
  EXPECT_LT((T_WB.t - on.t).norm(), 3e-3);
  const Vector3d turn = logSO3(T_WB.R * on.R.transpose());
  EXPECT_NEAR(turn.norm(), kDegree, 0.05 * kDegree);
  EXPECT_LT(std::abs(turn.z()), 0.02 * kDegree);
  // Roll and pitch are the new ones: what is vertical to the body.
  const SE3& T_AB = reported->states.back().T_WB;
  EXPECT_LT((T_WB.R.row(2) - T_AB.R.row(2)).norm(), 0.02 * kDegree);

  // And the next frame follows from there.
  add(&pipeline, kWindowKeyframes + 1, kWindowKeyframes + 2);
  const SE3 moved =
      flight().truth(now).inverse() * flight().truth(flight().frames[kWindowKeyframes + 1].t);
  const SE3 expected = T_WB * moved;
  const SE3 next = pipeline.trajectory().back().T_WB;
  EXPECT_LT((next.t - expected.t).norm(), 0.01);
  EXPECT_LT(logSO3(next.R.transpose() * expected.R).norm(), 0.2 * kDegree);
  EXPECT_EQ(pipeline.framesNotLocated(), 0);
}

TEST_F(PipelineWithAuto, OnlyMotionEndsTheWaitForMotion) {
  Pipeline pipeline =
      this->pipeline(options(), answers({rests(), says(gap()), rests(), says(moves())}),
                     [](const InitializationProblem& problem) {
                       return visualSolutionIn(problem, SE3(), biasInMotion());
                     });
  add(&pipeline, 0, kWindowKeyframes + 1);
  EXPECT_TRUE(pipeline.waitsForMotion());
  ASSERT_EQ(pipeline.attempts().size(), 2U);  // why it waits is on record
  EXPECT_EQ(pipeline.attempts()[1].initializer, "at_rest");
  EXPECT_EQ(pipeline.attempts()[1].decision.error().status, RefusalStatus::kImuGap);
  EXPECT_EQ(pipeline.attempts()[1].decision.error().reason, "a gap in the IMU");
  EXPECT_EQ(pipeline.attempts()[1].t, flight().frames[kWindowKeyframes].t);
  EXPECT_EQ(pipeline.attempts()[1].keyframes.size(), static_cast<size_t>(kWindowKeyframes));
  EXPECT_FALSE(pipeline.attempts()[1].accepted());
  add(&pipeline, kWindowKeyframes + 1, kWindowKeyframes + 2);  // at rest: nothing to tell
  EXPECT_TRUE(pipeline.waitsForMotion());
  EXPECT_EQ(pipeline.attempts().size(), 2U);
  add(&pipeline, kWindowKeyframes + 2, kWindowKeyframes + 3);
  EXPECT_FALSE(pipeline.waitsForMotion());
  ASSERT_EQ(pipeline.attempts().size(), 3U);
  EXPECT_EQ(pipeline.attempts()[2].initializer, "moving");
}

TEST_F(PipelineWithAuto, SaysWhyItDidNotStartAtRest) {
  Pipeline pipeline =
      this->pipeline(options(), says(moves()), [](const InitializationProblem& problem) {
        return visualSolutionIn(problem, SE3(), biasInMotion());
      });
  add(&pipeline, 0, kWindowKeyframes);
  ASSERT_EQ(pipeline.attempts().size(), 2U);
  EXPECT_EQ(pipeline.attempts()[0].initializer, "at_rest");
  EXPECT_EQ(pipeline.attempts()[0].decision.error().reason, "it moves");
  EXPECT_EQ(pipeline.attempts()[1].initializer, "moving");
  EXPECT_TRUE(pipeline.initializedAt());
  EXPECT_FALSE(pipeline.waitsForMotion());
  EXPECT_FALSE(pipeline.handedOverAt());  // there was nothing to take over
}

TEST_F(PipelineWithAuto, WaitsUntilEnoughOfTheWindowMoves) {
  PipelineOptions options = this->options();
  options.auto_initializer.min_motion_share = 1.0;  // both intervals of three keyframes
  Pipeline pipeline = this->pipeline(options, answers({rests(), rests(), says(moves())}),
                                     [](const InitializationProblem& problem) {
                                       return visualSolutionIn(problem, SE3(), biasInMotion());
                                     });
  add(&pipeline, 0,
      kWindowKeyframes + 2);  // at rest until frame kWindowKeyframes, the next one moves
  EXPECT_TRUE(pipeline.waitsForMotion());
  EXPECT_EQ(pipeline.attempts().size(), 1U);
  add(&pipeline, kWindowKeyframes + 2, kWindowKeyframes + 3);
  EXPECT_EQ(pipeline.handedOverAt(), flight().frames[kWindowKeyframes + 2].t);
}

TEST_F(PipelineWithAuto, AWindowThatTellsNeitherRestNorMotionCountsAsRest) {
  PipelineOptions options = this->options();
  options.auto_initializer.min_motion_share = 1.0;
  Pipeline pipeline = this->pipeline(options, answers({rests(), says(gap()), says(moves())}),
                                     [](const InitializationProblem& problem) {
                                       return visualSolutionIn(problem, SE3(), biasInMotion());
                                     });
  add(&pipeline, 0, kWindowKeyframes + 2);
  EXPECT_TRUE(pipeline.waitsForMotion());
  add(&pipeline, kWindowKeyframes + 2, kWindowKeyframes + 3);
  EXPECT_EQ(pipeline.handedOverAt(), flight().frames[kWindowKeyframes + 2].t);
}

TEST_F(PipelineWithAuto, TheGyroBiasOfTheStartIsThePriorUnlessMeasurementsWouldCountTwice) {
  std::vector<BiasPriors> priors;
  Pipeline pipeline = this->pipeline(options(), answers({rests(), says(moves())}),
                                     [&priors](const InitializationProblem& problem) {
                                       priors.push_back(problem.priors());
                                       return refuse(RefusalStatus::kTooLittleMotion, "later");
                                     });
  add(&pipeline, 0, kWindowKeyframes + 2);
  const BiasPriors configured = options().window.priors;
  ASSERT_EQ(priors.size(), 2U);
  // One keyframe on, the windows have an interval in common.
  EXPECT_EQ(priors[0].mean.gyro, configured.mean.gyro);
  EXPECT_EQ(priors[0].sigma_gyro_rps, configured.sigma_gyro_rps);
  // Two keyframes on, no more: from the end of the first window its covariance grows.
  EXPECT_EQ(priors[1].mean.gyro, biasAtRest().gyro);
  const double walk = flight().calibration.imu.noise.gyro_random_walk *
                      std::sqrt((kWindowKeyframes - 1) / kFrameRateHz);
  EXPECT_NEAR(priors[1].sigma_gyro_rps, std::hypot(kSigmaBias, walk), 1e-9);
  EXPECT_EQ(priors[1].mean.accel, configured.mean.accel);
  EXPECT_EQ(priors[1].sigma_accel_mps2, configured.sigma_accel_mps2);
}

}  // namespace
}  // namespace etalon::pipeline_test
