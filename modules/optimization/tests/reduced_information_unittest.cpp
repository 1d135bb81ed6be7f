#include "etalon/optimization/bundle/reduced_information.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>

#include "etalon/testing/synthetic_window.h"

namespace etalon {
namespace {

using Eigen::Vector3d;
using testing::SyntheticWindow;
using testing::SyntheticWindowOptions;

TEST(NormalEquations, MovingAllTogetherChangesNothing) {
  SyntheticWindowOptions options;
  options.motion = testing::Motion::kAggressive;
  options.landmarks = 60;
  options.landmark_distance_m = 20.0;
  options.sigma_px = 0.5;
  const SyntheticWindow synthetic = testing::makeSyntheticWindow(options);
  VisualWindow window =
      buildVisualWindow(synthetic.calibration, synthetic.keyframes(), options.sigma_px);
  std::vector<SE3> T_WB;
  for (const StampedState& s : synthetic.truth) T_WB.push_back(s.T_WB);
  std::vector<InverseDepthLandmark> landmarks;
  for (const LandmarkId id : window.landmark_ids) {
    // About a point that no camera is at.
    landmarks.emplace_back(synthetic.landmarks[id], T_WB[0].t + Vector3d(1.0, -2.0, 0.5));
    landmarks.back().parameters.head<2>() += Eigen::Vector2d(1e-4, -2e-4);
  }
  const Eigen::Index n = 6 * window.keyframe_count;
  NormalEquations equations(n);
  for (VisualMeasurement& m : window.measurements) m.inlier = true;
  addReducedVisualInformation(window, T_WB, {landmarks, std::vector<char>(landmarks.size(), 0)},
                              huberOfInliers(1e4), &equations);
  const Eigen::MatrixXd difference = equations.curvature - equations.score;
  EXPECT_GT(difference.norm(), 1e-4 * equations.score.norm());  // there is something to change
  for (int axis = 0; axis < 3; ++axis) {
    const Vector3d omega = Vector3d::Unit(axis);
    Eigen::VectorXd turned(n), shifted(n);
    for (size_t k = 0; k < T_WB.size(); ++k) {
      const Eigen::Index i = 6 * k;
      turned.segment<6>(i) << T_WB[k].R.transpose() * omega, omega.cross(T_WB[k].t - T_WB[0].t);
      shifted.segment<6>(i) << Vector3d::Zero(), omega;
    }
    // Rounding and the 1e-12 that keeps a landmark's own information invertible.
    EXPECT_LT((difference * turned).norm(), 1e-6 * difference.norm());
    EXPECT_LT((difference * shifted).norm(), 1e-6 * difference.norm());
    EXPECT_LT((equations.score * turned).norm(), 1e-6 * equations.score.norm());
  }
}

}  // namespace
}  // namespace etalon
