#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>

#include "etalon/core/errors.h"
#include "etalon/core/so3.h"
#include "etalon/imu/imu_buffer.h"
#include "etalon/imu/preintegration.h"
#include "etalon/simulation/integrated_trajectory.h"
#include "etalon/simulation/profile_trajectory.h"
#include "etalon/simulation/recorded_trajectory.h"

namespace etalon {
namespace {

using Eigen::Vector3d;

ProfileTrajectory profileFlight(MotionProfile profile, std::uint64_t seed = 3,
                                double duration_s = 20.0) {
  ProfileOptions options;
  options.profile = profile;
  options.seed = seed;
  options.duration_s = duration_s;
  return ProfileTrajectory(options);
}

// Central differences over h = 1 ms: truncation h^2/6 times the third derivative (at most about 60
// m/s^3 or rad/s^3 here), i.e. 1.5e-5; rounding 1e-16 * 3 / h = 3e-13.
void expectConsistentDerivatives(const SimulatedTrajectory& trajectory) {
  constexpr TimeNs kStep = 1'000'000;
  constexpr double kTolerance = 3e-5;
  for (TimeNs t = trajectory.start() + kStep; t + kStep < trajectory.end(); t += 137'000'011) {
    const TrajectoryState before = trajectory.at(t - kStep), now = trajectory.at(t),
                          after = trajectory.at(t + kStep);
    const double dt = secondsBetween(before.t, after.t);
    EXPECT_LT(((after.T_WB.t - before.T_WB.t) / dt - now.v_WB).norm(), kTolerance);
    EXPECT_LT(((after.v_WB - before.v_WB) / dt - now.a_W).norm(), kTolerance);
    EXPECT_LT((logSO3(before.T_WB.R.transpose() * after.T_WB.R) / dt - now.omega_B).norm(),
              kTolerance);
    EXPECT_NEAR((now.T_WB.R.transpose() * now.T_WB.R - Eigen::Matrix3d::Identity()).norm(), 0.0,
                1e-14);
  }
}

GroundTruth recordingOf(const SimulatedTrajectory& trajectory, double rate_hz) {
  GroundTruth recording;
  for (std::int64_t k = 0;; ++k) {
    const TimeNs t = stampAtRate(trajectory.start(), rate_hz, k);
    if (t > trajectory.end()) return recording;
    const TrajectoryState state = trajectory.at(t);
    recording.states.push_back({t, state.T_WB, state.v_WB});
  }
}

TEST(ProfileTrajectory, DerivativesAgreeWithDifferences) {
  for (MotionProfile profile :
       {MotionProfile::kGentle, MotionProfile::kAggressive, MotionProfile::kPureRotation}) {
    expectConsistentDerivatives(profileFlight(profile));
  }
}

TEST(ProfileTrajectory, ImuValuesAreSmooth) {
  const ProfileTrajectory trajectory = profileFlight(MotionProfile::kAggressive);
  // Second differences of a function whose second derivative exists and is bounded shrink with the
  // square of the step; a kink would make the quotient grow as 1 / step.
  for (TimeNs step : {TimeNs{10'000'000}, TimeNs{1'000'000}}) {
    double worst = 0.0;
    for (TimeNs t = trajectory.start() + step; t + step < trajectory.end(); t += step) {
      const double h = 1e-9 * static_cast<double>(step);
      const TrajectoryState a = trajectory.at(t - step), b = trajectory.at(t),
                            c = trajectory.at(t + step);
      worst = std::max(worst, (a.a_W - 2.0 * b.a_W + c.a_W).norm() / (h * h));
      worst = std::max(worst, (a.omega_B - 2.0 * b.omega_B + c.omega_B).norm() / (h * h));
    }
    EXPECT_LT(worst, 100.0);  // 42 in SI units at both steps
  }
}

TEST(ProfileTrajectory, StartsAtRestAndTakesOff) {
  for (MotionProfile profile : {MotionProfile::kGentle, MotionProfile::kAggressive}) {
    const ProfileTrajectory trajectory = profileFlight(profile);
    const TrajectoryState first = trajectory.at(trajectory.start());
    const TrajectoryState resting = trajectory.at(trajectory.start() + durationNs(1.0));
    EXPECT_EQ(resting.v_WB, Vector3d::Zero());
    EXPECT_EQ(resting.omega_B, Vector3d::Zero());
    EXPECT_EQ(resting.T_WB.t, first.T_WB.t);
    const TrajectoryState flying = trajectory.at(trajectory.start() + durationNs(5.0));
    EXPECT_GT(flying.v_WB.norm() + flying.omega_B.norm(), 0.1);
  }
}

TEST(ProfileTrajectory, ExcitesEveryAxis) {
  for (MotionProfile profile : {MotionProfile::kGentle, MotionProfile::kAggressive}) {
    for (std::uint64_t seed = 1; seed <= 10; ++seed) {
      const ProfileTrajectory trajectory = profileFlight(profile, seed);
      Eigen::Array3d a2 = Eigen::Array3d::Zero(), w2 = Eigen::Array3d::Zero();
      int count = 0;
      for (TimeNs t = trajectory.start() + durationNs(4.0); t < trajectory.end();
           t += durationNs(0.05), ++count) {
        const TrajectoryState state = trajectory.at(t);
        a2 += state.a_W.array().square();
        w2 += state.omega_B.array().square();
        EXPECT_GT(state.T_WB.t.z(), 0.1) << "below the floor, seed " << seed;
        EXPECT_GT(state.T_WB.R(2, 0), 0.7) << "the body's x axis points up, seed " << seed;
      }
      EXPECT_GT((a2 / count).sqrt().minCoeff(), 0.1) << seed;   // m/s^2
      EXPECT_GT((w2 / count).sqrt().minCoeff(), 0.05) << seed;  // rad/s
    }
  }
}

TEST(ProfileTrajectory, StaticIsStatic) {
  const ProfileTrajectory trajectory = profileFlight(MotionProfile::kStatic);
  const TrajectoryState first = trajectory.at(trajectory.start());
  for (TimeNs t = trajectory.start(); t <= trajectory.end(); t += durationNs(0.37)) {
    const TrajectoryState state = trajectory.at(t);
    EXPECT_EQ(state.T_WB.R, first.T_WB.R);
    EXPECT_EQ(state.T_WB.t, first.T_WB.t);
    EXPECT_EQ(state.v_WB, Vector3d::Zero());
    EXPECT_EQ(state.a_W, Vector3d::Zero());
    EXPECT_EQ(state.omega_B, Vector3d::Zero());
  }
}

TEST(ProfileTrajectory, PureRotationStaysInPlace) {
  const ProfileTrajectory trajectory = profileFlight(MotionProfile::kPureRotation);
  double fastest = 0.0;
  for (TimeNs t = trajectory.start(); t <= trajectory.end(); t += durationNs(0.1)) {
    const TrajectoryState state = trajectory.at(t);
    EXPECT_EQ(state.T_WB.t, trajectory.at(trajectory.start()).T_WB.t);
    EXPECT_EQ(state.a_W, Vector3d::Zero());
    fastest = std::max(fastest, state.omega_B.norm());
  }
  EXPECT_GT(fastest, 0.3);
}

TEST(ProfileTrajectory, SeedDecides) {
  const TimeNs t = ProfileOptions().start + durationNs(10.0);
  EXPECT_EQ(profileFlight(MotionProfile::kGentle, 5).at(t).T_WB.t,
            profileFlight(MotionProfile::kGentle, 5).at(t).T_WB.t);
  EXPECT_NE(profileFlight(MotionProfile::kGentle, 5).at(t).T_WB.t,
            profileFlight(MotionProfile::kGentle, 6).at(t).T_WB.t);
}

TEST(ProfileTrajectory, RefusesWhatCannotBe) {
  EXPECT_THROW(profileFlight(MotionProfile::kGentle, 1, -1.0), ConfigError);
  EXPECT_THROW(motionProfileFromName("agressive"), ConfigError);
  EXPECT_EQ(motionProfileFromName("pure-rotation"), MotionProfile::kPureRotation);
}

TEST(IntegratedTrajectory, PreintegrationGivesItBack) {
  const IntegratedTrajectory trajectory(profileFlight(MotionProfile::kAggressive), 200.0);
  const Vector3d g_W(0.0, 0.0, -9.81);
  const ImuBuffer buffer(trajectory.samples());
  for (double window_s : {0.25, 2.25}) {
    for (TimeNs t = trajectory.start() + durationNs(3.0); t < trajectory.end() - durationNs(3.0);
         t += durationNs(0.5)) {
      const TrajectoryState a = trajectory.at(t), b = trajectory.at(t + durationNs(window_s));
      const Preintegration imu(buffer.between(a.t, b.t), ImuBias(), ImuNoiseDensities());
      const Preintegration::Deltas& d = imu.deltas();
      const double dt = imu.dt();
      // 450 steps of rounding.
      EXPECT_LT((a.T_WB.R * d.dR - b.T_WB.R).norm(), 1e-12);
      EXPECT_LT((a.v_WB + g_W * dt + a.T_WB.R * d.dv - b.v_WB).norm(), 1e-11);
      EXPECT_LT((a.T_WB.t + a.v_WB * dt + 0.5 * g_W * dt * dt + a.T_WB.R * d.dp - b.T_WB.t).norm(),
                1e-11);
    }
  }
}

TEST(IntegratedTrajectory, StaysNearTheSmoothOne) {
  const ProfileTrajectory smooth = profileFlight(MotionProfile::kAggressive);
  const IntegratedTrajectory integrated(smooth, 200.0);
  for (TimeNs t = smooth.start(); t < integrated.end(); t += durationNs(0.3333)) {
    const TrajectoryState a = smooth.at(t), b = integrated.at(t);
    // The discretisation drifts: 5e-5 rad and 2.3 cm after 20 s; ten times that would be a bug.
    EXPECT_LT(logSO3(a.T_WB.R.transpose() * b.T_WB.R).norm(), 5e-4);
    EXPECT_LT((a.T_WB.t - b.T_WB.t).norm(), 0.2);
    EXPECT_LT((a.omega_B - b.omega_B).norm(), 1e-3);
  }
}

TEST(SplineTrajectory, DerivativesAgreeWithDifferencesAndRowsAreMet) {
  const ProfileTrajectory original = profileFlight(MotionProfile::kAggressive, 4, 8.0);
  const GroundTruth recording = recordingOf(original, 200.0);
  const SplineTrajectory spline(recording);
  expectConsistentDerivatives(spline);
  for (const StampedState& row : recording.states) {
    const TrajectoryState state = spline.at(row.t);
    // A quintic spline with 50 ms knots on motion below 1 Hz: error of order (2 pi f h)^6 / 720.
    EXPECT_LT((state.T_WB.t - row.T_WB.t).norm(), 1e-5);
    EXPECT_LT(logSO3(state.T_WB.R.transpose() * row.T_WB.R).norm(), 1e-5);
  }
}

TEST(SplineTrajectory, ToleratesAGapAndRefusesTooLittle) {
  GroundTruth recording = recordingOf(profileFlight(MotionProfile::kGentle, 4, 6.0), 200.0);
  recording.states.erase(recording.states.begin() + 600, recording.states.begin() + 640);
  const SplineTrajectory spline(recording);
  EXPECT_TRUE(spline.at(spline.start() + durationNs(3.1)).T_WB.t.allFinite());
  recording.states.resize(9);
  EXPECT_THROW(SplineTrajectory{recording}, ConfigError);
}

TEST(InterpolatedTrajectory, GivesTheRowsThemselves) {
  const ProfileTrajectory original = profileFlight(MotionProfile::kAggressive, 4, 8.0);
  GroundTruth recording = recordingOf(original, 200.0);
  for (bool has_velocity : {true, false}) {
    recording.has_velocity = has_velocity;
    const InterpolatedTrajectory trajectory(recording);
    for (size_t k = 10; k + 10 < recording.states.size(); k += 13) {
      const StampedState& row = recording.states[k];
      const TrajectoryState state = trajectory.at(row.t), truth = original.at(row.t);
      EXPECT_LT((state.T_WB.t - row.T_WB.t).norm(), 1e-12);
      EXPECT_LT((state.T_WB.R - row.T_WB.R).norm(), 1e-12);
      // Central differences over 10 ms: h^2/6 = 4e-6 s^2 times third derivatives below 60.
      EXPECT_LT((state.v_WB - truth.v_WB).norm(), 1e-3);
      EXPECT_LT((state.a_W - truth.a_W).norm(), 1e-2);
      EXPECT_LT((state.omega_B - truth.omega_B).norm(), 1e-3);
    }
  }
}

}  // namespace
}  // namespace etalon
