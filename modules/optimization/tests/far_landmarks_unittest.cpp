#include <gtest/gtest.h>

#include <random>

#include "etalon/core/symmetric.h"
#include "visual_inertial_case.h"

namespace etalon {
namespace {

using Eigen::Vector3d;
using testing::SyntheticWindowOptions;

/** Of the last keyframe's velocity over 30 windows whose landmarks are all at `distance_m`: NEES
 * summed over the windows that claim to know it, their number, landmarks at infinity. */
struct VelocityOfFarLandmarks {
  double nees = 0.0;
  int claiming = 0, far_at_all = 0;
};

VelocityOfFarLandmarks velocityOfFarLandmarks(double distance_m) {
  std::mt19937 random(8);
  std::normal_distribution<double> normal;
  const auto drawn = [&] { return Vector3d(normal(random), normal(random), normal(random)); };
  VelocityOfFarLandmarks sum;
  for (unsigned run = 0; run < 30; ++run) {
    SyntheticWindowOptions options;
    options.motion = testing::Motion::kAggressive;
    options.seed = 700 + run;
    options.frames_per_keyframe = 1;
    options.landmarks = 120;
    options.landmark_distance_m = distance_m;
    options.sigma_px = 0.5;
    options.gyro_noise_factor = options.accel_noise_factor = 1.0;
    VisualInertialBaOptions ba;
    ba.sigma_shared_deg = ba.sigma_turn_deg = 1e-4;  // the synthetic pixels err each for itself
    const BiasPriors priors;
    const Vector3d gyro = 0.1 * priors.sigma_gyro_rps * drawn();
    options.bias = {gyro, priors.sigma_accel_mps2 * drawn()};
    VisualInertialCase c(options, options.sigma_px);
    std::vector<SE3> T_WB;
    for (const NavState& s : c.states) T_WB.push_back(s.T_WB);
    VisualInertialProblem problem{
        BundleProblem(c.window), c.preintegrations, c.states, options.bias, c.priors,
        options.gravity_mps2};
    problem.bundle.triangulateMissing(T_WB);
    const VisualInertialBaResult result = solveVisualInertialBa(std::move(problem), ba);
    EXPECT_TRUE(result.summary.message.empty()) << result.summary.message;
    for (const BundleLandmark& landmark : result.bundle.landmarks)
      sum.far_at_all += (landmark.position - T_WB[0].t).norm() > 0.99 * kFarthestLandmark;
    if (!(sigmaVelocity(result) <= 0.1)) continue;  // as the acceptance has it
    const Eigen::Index v = 9 * (result.states.size() - 1) + 6;
    const Vector3d e = result.states.back().v_WB - c.states.back().v_WB;
    sum.nees += squaredMahalanobis(e, result.covariance.block<3, 3>(v, v));
    ++sum.claiming;
  }
  return sum;
}

TEST(VisualInertialBa, FarLandmarksGiveAVelocityAsGoodAsItSays) {
  for (const double distance_m : {20.0, 150.0}) {
    const VelocityOfFarLandmarks sum = velocityOfFarLandmarks(distance_m);
    SCOPED_TRACE(distance_m);
    ASSERT_GE(sum.claiming, 20);
    EXPECT_GT(sum.nees / (3.0 * sum.claiming), 0.7);
    EXPECT_LT(sum.nees / (3.0 * sum.claiming), 1.5);
  }
}

TEST(VisualInertialBa, LandmarksTooFarGiveNoVelocity) {
  for (const double distance_m : {500.0, 1e9}) {
    SCOPED_TRACE(distance_m);
    const VelocityOfFarLandmarks sum = velocityOfFarLandmarks(distance_m);
    EXPECT_EQ(sum.claiming, 0);
    EXPECT_GT(sum.far_at_all, 30 * 30);  // thirty a window and more
  }
}

}  // namespace
}  // namespace etalon
