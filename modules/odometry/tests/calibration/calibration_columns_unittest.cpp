// The calibration as unknowns: what it does to a pixel, and in the equations of a window.

#include <gtest/gtest.h>

#include "../point_scene.h"
#include "etalon/core/angles.h"
#include "etalon/core/so3.h"
#include "etalon/core/symmetric.h"
#include "etalon/testing/expect_jacobian.h"
#include "fixed_lag/visual_terms.h"
#include "fixed_lag/window_solver.h"

namespace etalon::fixed_lag {
namespace {

using Eigen::MatrixXd;
using Eigen::Vector2d;
using Eigen::Vector3d;
using Eigen::VectorXd;

/** A tenth of what a calibration may be wrong by, of every quantity. */
CalibrationVector wrong() {
  CalibrationVector deviation = 0.1 * calibrationPriorSigma();
  for (Eigen::Index c = 0; c < kCalibrationSize; c += 2) deviation[c] *= -0.7;
  return deviation;
}

StereoInertialCalibration fisheyeRig() {
  StereoInertialCalibration rig = eurocCalibration();
  for (CameraCalibration& camera : rig.cameras)
    camera.model = CameraModel("pinhole", "equidistant", 752, 480, {380.0, 378.0, 367.0, 248.0},
                               {-0.01, 0.02, -0.005, 0.001});
  return rig;
}

void expectDerivativesOfTheReprojection(const StereoInertialCalibration& given) {
  const SE3 T_HT(expSO3({0.02, -0.1, 0.05}), {0.3, -0.1, 0.2});
  const InverseDepthLandmark landmark(given.cameras[0].T_BC * Vector3d(0.8, -0.4, 3.0),
                                      given.cameras[0].T_BC.t);
  for (const CalibrationVector& at : {CalibrationVector(CalibrationVector::Zero()), wrong()})
    for (size_t c = 0; c < 2; ++c) {
      const StereoInertialCalibration now = corrected(given, at);
      const Vector3d p_C = (T_HT * now.cameras[c].T_BC).inverse() * landmark.position();
      const Vector2d pixel = *now.cameras[c].model.project(p_C) + Vector2d(0.3, -0.2);
      // The pixel is what was measured: another calibration sees another direction there.
      const auto residual = [&](const CalibrationVector& deviation) {
        const StereoInertialCalibration moved = corrected(given, deviation);
        Vector2d r;
        const auto m = makeMeasurement(moved.cameras[c].model, pixel, 0.35);
        EXPECT_TRUE(reprojectionResidual(moved.cameras[c].T_BC.inverse(), *m, T_HT, landmark, &r));
        return r;
      };
      const auto measurement = makeMeasurement(now.cameras[c].model, pixel, 0.35);
      const CalibrationJacobian J =
          CalibrationDerivatives(given, at)(c, *measurement, T_HT, landmark);
      // Leaves out that the distortion's slope changes within the residual of 0.36 px.
      testing::expectJacobian(J, residual, at, {1e-4, 2e-3});
      EXPECT_EQ(J.col(kTimeOffset).norm(), 0.0);
      EXPECT_EQ(J.middleCols<6>(kStereoRotation).isZero(0.0), c == 0);
    }
}

TEST(CalibrationDerivatives, AreThoseOfTheReprojection) {
  expectDerivativesOfTheReprojection(eurocCalibration());
  expectDerivativesOfTheReprojection(fisheyeRig());
}

TEST(CalibrationDerivatives, AreZeroBehindTheCamera) {
  const StereoInertialCalibration given = eurocCalibration();
  const InverseDepthLandmark landmark(given.cameras[0].T_BC * Vector3d(0.0, 0.0, -3.0),
                                      Vector3d::Zero());
  const auto m = makeMeasurement(given.cameras[0].model, {300.0, 200.0}, 0.35);
  EXPECT_TRUE(CalibrationDerivatives(given, wrong())(0, *m, SE3(), landmark).isZero(0.0));
}

TEST(Corrected, DoesWhatTheColumnsSay) {
  const StereoInertialCalibration given = eurocCalibration();
  EXPECT_EQ(corrected(given, CalibrationVector::Zero()).cameras[1].T_BC.matrix(),
            given.cameras[1].T_BC.matrix());
  CalibrationVector longer = CalibrationVector::Zero();
  longer[kBaseline] = 0.01;
  EXPECT_NEAR(corrected(given, longer).baseline(), 1.01 * given.baseline(), 1e-12);
  CalibrationVector turned = CalibrationVector::Zero();
  turned.segment<3>(kCameraRotation) = Vector3d(0.01, 0.0, 0.0);
  const StereoInertialCalibration rig = corrected(given, turned);  // both cameras turn
  EXPECT_NEAR((rig.rightFromLeft().matrix() - given.rightFromLeft().matrix()).norm(), 0.0, 1e-12);
  EXPECT_NEAR(logSO3(given.cameras[0].T_BC.R.transpose() * rig.cameras[0].T_BC.R).x(), 0.01, 1e-12);
  CalibrationVector lens = CalibrationVector::Zero();
  lens[kFocal + 1] = 0.002;
  lens[kPrincipalPoint + 3] = -1.5;
  lens[kRadialDistortion + 3] = 0.5;
  const StereoInertialCalibration lenses = corrected(given, lens);
  EXPECT_TRUE(lenses.cameras[0].model == given.cameras[0].model);
  EXPECT_NEAR(lenses.cameras[1].model.focal().x(), 1.002 * given.cameras[1].model.focal().x(),
              1e-9);
  EXPECT_NEAR(lenses.cameras[1].model.principalPoint().y(),
              given.cameras[1].model.principalPoint().y() - 1.5, 1e-9);
}

TEST(Corrected, RadialDistortionShiftsAPixelAtSixthsOfTheWidthFromTheAxis) {
  const RadialShift shifts(0.1, -0.2, 0.5);
  CalibrationVector lens = CalibrationVector::Zero();
  lens.segment<kRadialShifts>(kRadialDistortion + kRadialShifts) = shifts;
  for (const bool fisheye : {false, true}) {
    const StereoInertialCalibration given = fisheye ? fisheyeRig() : eurocCalibration();
    const StereoInertialCalibration now = corrected(given, lens);
    EXPECT_TRUE(now.cameras[0].model == given.cameras[0].model);
    const CameraModel &before = given.cameras[1].model, &after = now.cameras[1].model;
    for (int i = 0; i < kRadialShifts; ++i) {
      const double r = (i + 1) / 6.0 * before.width() / before.focal().x();
      const Vector3d ray(fisheye ? std::tan(r) : r, 0.0, 1.0);
      const Vector2d shift = *after.project(ray) - *before.project(ray);
      EXPECT_NEAR(shift.x(), shifts[i], 1e-9);
      EXPECT_NEAR(shift.y(), 0.0, 1e-9);
    }
  }
}

TEST(Remeasured, IsTheSamePixelOfAnotherCamera) {
  const CameraModel before = eurocCalibration().cameras[0].model;
  const CameraModel after = corrected(eurocCalibration(), wrong()).cameras[0].model;
  const Vector2d pixel(120.0, 400.0);
  const auto again = remeasured(before, after, *makeMeasurement(before, pixel, 0.29));
  const auto expected = makeMeasurement(after, pixel, 0.29);
  EXPECT_NEAR((again.xy - expected->xy).norm(), 0.0, 1e-9);
  EXPECT_NEAR((again.sqrt_information - expected->sqrt_information).norm(), 0.0, 1e-6);
}

/** Five states that turn and move around twelve points, with a calibration that is unknown. */
struct Scene : PointScene {
  std::vector<Landmark*> landmarks;

  Scene() : PointScene(12) {
    addCalibrationColumns(calibration, &window);
    Tracks tracks(calibration, {});
    tracks.createLandmarks(measured(seeFromNewest()), &window);
    for (int k = 1; k < 5; ++k) {
      append({expSO3({0.01 * k, -0.02 * k, 0.03 * k}), {0.1 * k, -0.05 * k, 0.02 * k}});
      tracks.associate(measured(seeFromNewest()), 1e-2 * Eigen::Matrix<double, 6, 6>::Identity(),
                       &window);
    }
    std::mt19937 random(1);
    std::normal_distribution<double> normal;
    for (WindowState& state : window.states) {
      Vector15d d = Vector15d::Zero();
      for (int c = 0; c < 6; ++c) d[c] = 1e-4 * normal(random);
      state.now = state.linearization = state.now.plus(d);
      state.fixed = false;
      for (int c = 0; c < 6; ++c) state.twist_B[c] = normal(random);
    }
    for (auto& [id, landmark] : window.landmarks) landmarks.push_back(&landmark);
    setCalibration(wrong(), &window);
  }

  NormalEquations linearized(VisualTerms* terms) {
    NormalEquations equations(window.unknowns());
    terms->linearize(window, landmarks, static_cast<int>(window.states.size()) - 1, &equations,
                     true);
    return equations;
  }
  /** Landmarks at their best places. */
  void settle() {
    VisualTerms terms;
    for (int k = 0; k < 60; ++k) {
      linearized(&terms);
      terms.solveLandmarks(window, VectorXd::Zero(window.unknowns()));
    }
  }
};

TEST(CalibrationColumns, TheBodyTurnsToTheImageByTheRateOnThatSideOfTheStamp) {
  for (const double offset : {0.01, -0.01}) {
    PointScene scene(12);
    addCalibrationColumns(scene.calibration, &scene.window);
    for (const double rate : {0.1, 0.5}) {
      std::vector<ImuSample> imu;
      const TimeNs begin = scene.window.states.back().t;
      for (TimeNs t = 0; t <= PointScene::kStep; t += PointScene::kStep / 10)
        imu.push_back({begin + t, {rate, 0.0, 0.0}, {0.0, 0.0, 9.81}});
      appendState(Preintegration(imu, {}, scene.noise), &scene.window);
    }
    CalibrationVector deviation = CalibrationVector::Zero();
    deviation[kTimeOffset] = offset;
    setCalibration(deviation, &scene.window);
    updateImageTimes(&scene.window);
    const WindowState& state = scene.window.states[1];
    EXPECT_NEAR(state.twist_B.x() + state.now.bias.gyro.x(), offset > 0.0 ? 0.5 : 0.1, 1e-12);
  }
}

TEST(CalibrationColumns, TheGradientIsThatOfTheCostOnceLandmarksAreBest) {
  Scene scene;
  scene.settle();
  VisualTerms terms;
  const NormalEquations equations = scene.linearized(&terms);
  const CalibrationVector at = scene.window.calibration.now;
  const auto cost = [&](const CalibrationVector& deviation) {
    Window moved = scene.window;
    setCalibration(deviation, &moved);
    std::vector<Landmark*> landmarks;
    for (auto& [id, landmark] : moved.landmarks) landmarks.push_back(&landmark);
    return VisualTerms().cost(moved, landmarks);
  };
  // The cost is x^T H x + 2 g^T x + cost; its parts have units of their own.
  for (Eigen::Index c = 0; c < kCalibrationSize; ++c) {
    const CalibrationVector h = 1e-3 * calibrationPriorSigma()[c] * CalibrationVector::Unit(c);
    const double numerical = (cost(at + h) - cost(at - h)) / (4.0 * h.norm());
    // The derivatives by the lens leave the change of the whitening out.
    EXPECT_NEAR(equations.g[c], numerical, 1e-3 * std::sqrt(equations.H(c, c) * equations.cost))
        << c;
  }
}

TEST(CalibrationColumns, AStepOfTheCalibrationTakesTheLandmarksAlong) {
  // To where they end up by themselves, but for the curvature: a tenth of the way.
  Scene scene;
  scene.settle();
  VisualTerms terms;
  scene.linearized(&terms);
  std::vector<Vector3d> before, followed;
  for (const Landmark* l : scene.landmarks) before.push_back(l->in_host.parameters);
  const CalibrationVector moved = 0.05 * calibrationPriorSigma();
  VectorXd step = VectorXd::Zero(scene.window.unknowns());
  step.head<kCalibrationSize>() = moved;
  terms.solveLandmarks(scene.window, step);
  for (const Landmark* l : scene.landmarks) followed.push_back(l->in_host.parameters);
  setCalibration(scene.window.calibration.now + moved, &scene.window);
  scene.settle();
  for (size_t l = 0; l < before.size(); ++l) {
    const Vector3d& after = scene.landmarks[l]->in_host.parameters;
    EXPECT_GT((after - before[l]).norm(), 1e-5) << l;
    EXPECT_LT((after - followed[l]).norm(), 0.1 * (after - before[l]).norm()) << l;
  }
}

TEST(CalibrationColumns, TheEquationsAreSemidefiniteAndKnowNothingOfTheWorld) {
  Scene scene;
  for (size_t i = 0; i < scene.window.states.size(); ++i) {
    WindowState& state = scene.window.states[i];
    state.fixed = true;  // linearisation points are elsewhere
    state.linearization = state.now.plus(0.05 * Vector15d::Constant(i % 2 ? 1.0 : -1.0));
  }
  VisualTerms terms;
  const NormalEquations equations = scene.linearized(&terms);
  EXPECT_LT((equations.H - equations.H.transpose()).norm(), 1e-9 * equations.H.norm());
  MatrixXd N = MatrixXd::Zero(scene.window.unknowns(), 6);
  for (const WindowState& state : scene.window.states) {
    const SE3& T_WB = state.linearization.T_WB;
    N.block<3, 3>(state.column, 0) = T_WB.R.transpose();
    N.block<3, 3>(state.column + 3, 0) = -hat(T_WB.t);
    N.block<3, 3>(state.column + 3, 3).setIdentity();
  }
  EXPECT_LT((equations.H * N).norm(), 1e-9 * equations.H.norm());
  const VectorXd scale = equations.H.diagonal().cwiseMax(1e-12).cwiseSqrt().cwiseInverse();
  const MatrixXd unit = scale.asDiagonal() * equations.H * scale.asDiagonal();
  EXPECT_GT(symmetricEigenvalues(unit)[0], -1e-9);
}

TEST(CalibrationColumns, HeldTheyChangeNothingOfTheSolution) {
  // The prior of the calibration alone, and no deviation: the states are where they would be.
  PointScene with(30), without(30);
  addCalibrationColumns(with.calibration, &with.window);
  for (PointScene* scene : {&with, &without}) {
    Tracks tracks(scene->calibration, {});
    tracks.createLandmarks(scene->measured(scene->seeFromNewest()), &scene->window);
    scene->append(movedTo(0.02, 0.05, 0.0));
    tracks.associate(scene->measured(scene->seeFromNewest()), PointScene::wellKnown(),
                     &scene->window);
    scene->window.states.back().now.T_WB.t.x() += 0.002;
    WindowSolver({}).solve(&scene->window, SolverOptions().iterations, false);
  }
  EXPECT_EQ(with.window.unknowns(), without.window.unknowns() + kCalibrationSize);
  EXPECT_LT(
      (with.window.states.back().now.T_WB.matrix() - without.window.states.back().now.T_WB.matrix())
          .norm(),
      1e-9);
}

}  // namespace
}  // namespace etalon::fixed_lag
