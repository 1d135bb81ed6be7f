// Where a view should show a landmark, and which of what was found there is believed.

#include "etalon/map/view_geometry.h"

#include <gtest/gtest.h>

#include <random>

#include "etalon/core/so3.h"
#include "etalon/map/view_selection.h"
#include "etalon/simulation/euroc_rig.h"

namespace etalon {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr double kSigmaPx = 0.5;

/** Landmarks 2 to 6 m before the camera of the current frame, and a view half a metre aside. */
struct Scene {
  StereoInertialCalibration calibration = eurocCalibration();
  SE3 true_T_NV{expSO3({0.05, -0.08, 0.1}), {0.3, 0.4, -0.2}};
  OldView view;  ///< 2 cm and half a degree off
  std::vector<SeenLandmark> seen;
  std::vector<FoundLandmark> found;
  std::mt19937_64 generator{5};

  explicit Scene(size_t count) {
    view.T_NV = {true_T_NV.R * expSO3({0.006, -0.005, 0.004}),
                 true_T_NV.t + Vector3d(0.012, -0.01, 0.015)};
    view.covariance.diagonal() << Vector3d::Constant(5e-5), Vector3d::Constant(2e-4);
    const CameraCalibration& left = calibration.cameras[0];
    std::uniform_real_distribution<double> u(60.0, 690.0), v(60.0, 420.0), depth(2.0, 6.0);
    while (seen.size() < count) {
      SeenLandmark landmark;
      landmark.id = static_cast<LandmarkId>(seen.size());
      landmark.pixel = {u(generator), v(generator)};
      landmark.p_N = left.T_BC * (depth(generator) * *left.model.unproject(landmark.pixel));
      if (!isInView(calibration, true_T_NV, landmark)) continue;
      seen.push_back(landmark);
    }
  }

  /** Finds the landmark, off by noise and by `error` px. */
  void find(size_t l, const Vector2d& error) {
    std::normal_distribution<double> normal(0.0, kSigmaPx);
    FoundLandmark f;
    f.landmark = l;
    const Vector3d p_V = true_T_NV.inverse() * seen[l].p_N;
    for (size_t camera = 0; camera < 2; ++camera) {
      const CameraCalibration& c = calibration.cameras[camera];
      const auto pixel = c.model.project(c.T_BC.inverse() * p_V);
      const Vector2d noise(normal(generator), normal(generator));
      const auto m = pixel ? makeMeasurement(c.model, *pixel + noise + error, kSigmaPx)
                           : std::optional<ReprojectionMeasurement>();
      if (m) f.measurements[camera] = *m;
      f.match.has_right = m.has_value();
    }
    found.push_back(f);
  }
  std::vector<FoundLandmark> believed() const {
    return agreeing(calibration, view, seen, found, 1.0, {});
  }
};

TEST(ViewGeometry, PredictsThePixelAndHowFarItMayBeOff) {
  const Scene scene(200);
  for (const SeenLandmark& landmark : scene.seen) {
    const auto query = predictInView(scene.calibration, scene.view, landmark, kSigmaPx);
    if (!query) continue;  // at the edge
    const CameraCalibration& left = scene.calibration.cameras[0];
    const auto truth =
        left.model.project(left.T_BC.inverse() * (scene.true_T_NV.inverse() * landmark.p_N));
    EXPECT_LT((*truth - query->left).norm(), query->reach_px);
    EXPECT_LT(query->reach_px, 40.0);
    // A neighbour on the plane that faces the camera, by the warp: to the second order of 3 px.
    const Vector3d p_C = left.T_BC.inverse() * landmark.p_N;
    const Vector3d ray = *left.model.unproject(landmark.pixel + Vector2d(3.0, -2.0));
    const Vector3d neighbour = left.T_BC * (ray * (p_C.squaredNorm() / p_C.dot(ray)));
    const auto there =
        left.model.project(left.T_BC.inverse() * (scene.view.T_NV.inverse() * neighbour));
    EXPECT_LT((query->left + query->A * Vector2d(3.0, -2.0) - *there).norm(), 0.05);
  }
}

TEST(ViewGeometry, LandmarksBehindOrFarAsideAreNotInView) {
  const Scene scene(1);
  const SeenLandmark& landmark = scene.seen[0];
  const SE3 turned(scene.true_T_NV.R * expSO3({0.0, M_PI, 0.0}), scene.true_T_NV.t);
  EXPECT_TRUE(isInView(scene.calibration, scene.true_T_NV, landmark));
  EXPECT_FALSE(isInView(scene.calibration, turned, landmark));
  // Three times as near.
  const Vector3d ray = landmark.p_N - scene.calibration.cameras[0].T_BC.t;
  EXPECT_FALSE(isInView(scene.calibration, {Eigen::Matrix3d::Identity(), 0.67 * ray}, landmark));
}

TEST(ViewGeometry, WhatAgreesIsBelievedAndWhatDoesNotIsLeftOut) {
  Scene scene(40);
  for (size_t l = 0; l < 40; ++l)
    scene.find(l,
               l % 4 == 0 ? Vector2d(5.0, -4.0 + 0.2 * static_cast<double>(l)) : Vector2d::Zero());
  const auto believed = scene.believed();
  EXPECT_GE(believed.size(), 28u);
  for (const FoundLandmark& f : believed) EXPECT_NE(f.landmark % 4, 0u);
}

TEST(ViewGeometry, AViewOfWhichTooLittleAgreesIsNotBelieved) {
  Scene few(40);
  for (size_t l = 0; l < 9; ++l) few.find(l, Vector2d::Zero());
  EXPECT_TRUE(few.believed().empty());
  Scene scattered(40);
  std::uniform_real_distribution<double> off(-12.0, 12.0);
  for (size_t l = 0; l < 40; ++l)
    scattered.find(l, l % 3 == 0 ? Vector2d::Zero()
                                 : Vector2d(off(scattered.generator), off(scattered.generator)));
  EXPECT_TRUE(scattered.believed().empty());
}

TEST(ViewGeometry, AViewThatWouldHaveToBeElsewhereIsNotBelieved) {
  // All agree with one another, and with a place ten standard deviations from where the view is.
  Scene scene(40);
  for (size_t l = 0; l < 40; ++l) scene.find(l, Vector2d::Zero());
  scene.view.T_NV.t += Vector3d(0.14, 0.0, 0.0);
  EXPECT_TRUE(scene.believed().empty());
}

TEST(ViewSelection, TheNewerOfTheTwoMostAlikeGoes) {
  const auto at = [](double x, double yaw) { return SE3(expSO3({0.0, yaw, 0.0}), {x, 0.0, 0.0}); };
  EXPECT_EQ(redundantView({at(0, 0), at(2, 0), at(2.5, 0), at(5, 0)}, {}), 2u);
  // The same place, another direction: not alike.
  EXPECT_EQ(redundantView({at(0, 0), at(0, 1.5), at(3, 0), at(3.5, 0)}, {}), 3u);
}

}  // namespace
}  // namespace etalon
