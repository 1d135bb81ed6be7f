#include "translation_constraint.h"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <Eigen/Geometry>
#include <map>
#include <utility>

#include "etalon/testing/initializer_checks.h"

namespace etalon::plugins {
namespace {

using Eigen::Index;
using Eigen::Matrix3d;
using Eigen::MatrixXd;
using Eigen::Vector3d;
using Eigen::VectorXd;
using testing::Motion;
using testing::SyntheticWindow;
using testing::SyntheticWindowOptions;

constexpr double kMinParallax = 0.01, kSigmaPx = 0.5;

struct ConstraintCase {
  explicit ConstraintCase(const SyntheticWindowOptions& window_options) : options(window_options) {
    window = testing::makeSyntheticWindow(options);
    const SE3 T_VW = window.truth[0].T_WB.inverse();
    for (const StampedState& state : window.truth) {
      R_VB.push_back(T_VW.R * state.T_WB.R);
      p.push_back(T_VW * state.T_WB.t);
    }
  }
  TranslationConstraint constraint(double min_parallax = kMinParallax) const {
    return {window.calibration, window.keyframes(), R_VB, kSigmaPx, min_parallax};
  }
  SyntheticWindowOptions options;
  SyntheticWindow window;
  std::vector<Matrix3d> R_VB;
  std::vector<Vector3d> p;  ///< the truth
};

SyntheticWindowOptions small() {
  SyntheticWindowOptions options;
  options.motion = Motion::kAggressive;
  options.keyframes = 4;
  options.landmarks = 40;
  return options;
}

/** The positions after one linear solution from `p`, with the first one held. */
std::vector<Vector3d> solved(const TranslationConstraint& constraint,
                             const std::vector<Vector3d>& p) {
  const Index n = 3 * p.size();
  MatrixXd H = MatrixXd::Zero(n, n);
  VectorXd g = VectorXd::Zero(n);
  constraint.addTo(p, &H, &g);
  const VectorXd step =
      H.bottomRightCorner(n - 3, n - 3).selfadjointView<Eigen::Lower>().llt().solve(-g.tail(n - 3));
  std::vector<Vector3d> result = p;
  for (size_t k = 1; k < p.size(); ++k) result[k] += step.segment<3>(3 * (k - 1));
  return result;
}

double farthest(const std::vector<Vector3d>& a, const std::vector<Vector3d>& b) {
  double result = 0.0;
  for (size_t k = 0; k < a.size(); ++k) result = std::max(result, (a[k] - b[k]).norm());
  return result;
}

/** One ray of a landmark. */
struct Ray {
  size_t keyframe;
  Vector3d direction, offset;  ///< in V; of the camera's centre from p_k
  double sigma_rad;
};

std::map<LandmarkId, std::vector<Ray>> raysOf(const ConstraintCase& c) {
  std::map<LandmarkId, std::vector<Ray>> rays;
  const std::vector<const TrackedFrame*> keyframes = c.window.keyframes();
  for (size_t k = 0; k < keyframes.size(); ++k)
    for (size_t camera = 0; camera < 2; ++camera)
      for (const Observation& o : keyframes[k]->observations) {
        if (camera == 1 && !o.has_right) continue;
        const CameraCalibration& calibration = c.window.calibration.cameras[camera];
        const auto ray = calibration.model.unproject(camera == 0 ? o.left : o.right);
        rays[o.id].push_back({k, c.R_VB[k] * calibration.T_BC.R * ray->normalized(),
                              c.R_VB[k] * calibration.T_BC.t,
                              kSigmaPx / std::sqrt(calibration.model.focal().prod())});
      }
  return rays;
}

/**
 * Half the sum of squares of README.md's rows at `p`, weighted by the noise at `at`. The base is
 * the two rays of widest angle. The depth brings a point of the first ray nearest to the second: it
 * is the vertex of a parabola through three points.
 */
double cost(const ConstraintCase& c, const std::vector<Vector3d>& p,
            const std::vector<Vector3d>& at) {
  double sum = 0.0;
  for (const auto& of_landmark : raysOf(c)) {
    const auto& rays = of_landmark.second;
    if (rays.front().keyframe == rays.back().keyframe) continue;
    size_t a = 0, b = 0;
    double sine = 0.0;
    for (size_t i = 0; i < rays.size(); ++i)
      for (size_t j = i + 1; j < rays.size(); ++j) {
        const double s = rays[i].direction.cross(rays[j].direction).norm();
        if (s > sine) {
          sine = s;
          a = i;
          b = j;
        }
      }
    if (sine < kMinParallax) continue;
    const auto centre = [&](size_t i, const std::vector<Vector3d>& q) {
      return Vector3d(q[rays[i].keyframe] + rays[i].offset);
    };
    const auto depth = [&](const std::vector<Vector3d>& q) {
      const auto miss = [&](double z) {
        return (centre(a, q) + z * rays[a].direction - centre(b, q))
            .cross(rays[b].direction)
            .squaredNorm();
      };
      const double before = miss(-1.0), here = miss(0.0), after = miss(1.0);
      return 0.5 * (before - after) / (before - 2.0 * here + after);
    };
    const double z = depth(p), z_at = depth(at);
    for (size_t i = 0; i < rays.size(); ++i) {
      if (i == a) continue;
      const Vector3d& d = rays[i].direction;
      const Vector3d y = centre(a, p) + z * rays[a].direction - centre(i, p);
      const double distance = d.dot(centre(a, at) + z_at * rays[a].direction - centre(i, at));
      const double s = d.cross(rays[a].direction).norm() / sine;
      const auto noise = [&](size_t j, double z_j) { return std::pow(rays[j].sigma_rad * z_j, 2); };
      const double variance =
          noise(i, distance) + noise(a, z_at) + s * s * (noise(a, z_at) + noise(b, z_at));
      sum += 0.5 * d.cross(y).squaredNorm() / variance;
    }
  }
  return sum;
}

/** The cameras' focal lengths differ by 0.2 %, which the bounds notice. */
TEST(DrtTranslationConstraint, HessianAndGradientAreThoseOfTheRowsByNumericalDerivatives) {
  const ConstraintCase c(small());
  TranslationConstraint constraint = c.constraint();
  constraint.reweight(c.p, false);
  constraint.chooseWidestBases();
  constraint.reweight(c.p, false);
  const Index n = 3 * c.p.size();
  std::vector<Vector3d> p = c.p;  // away from the minimum, so that the gradient is not zero
  for (size_t k = 0; k < p.size(); ++k) p[k] += 0.1 * static_cast<double>(k) * Vector3d(1, -2, 1.5);
  MatrixXd H = MatrixXd::Zero(n, n);
  VectorXd g = VectorXd::Zero(n);
  constraint.addTo(p, &H, &g);

  // The cost is quadratic, so differences with a long step are exact but for rounding.
  constexpr double kStep = 0.1;
  const auto moved = [&](Index i, double by) {
    std::vector<Vector3d> q = p;
    q[i / 3][i % 3] += by;
    return q;
  };
  for (Index i = 0; i < n; ++i) {
    const double here = cost(c, p, c.p), before = cost(c, moved(i, -kStep), c.p),
                 after = cost(c, moved(i, kStep), c.p);
    EXPECT_NEAR(g(i), (after - before) / (2.0 * kStep), 1e-7 * g.norm());
    EXPECT_NEAR(H(i, i), (after - 2.0 * here + before) / (kStep * kStep), 1e-7 * H.norm());
    VectorXd g_moved = VectorXd::Zero(n);
    MatrixXd ignored = MatrixXd::Zero(n, n);
    constraint.addTo(moved(i, kStep), &ignored, &g_moved);
    const VectorXd column = H.selfadjointView<Eigen::Lower>() * VectorXd::Unit(n, i);
    EXPECT_LT(((g_moved - g) / kStep - column).norm(), 1e-7 * H.norm());
  }
}

TEST(DrtTranslationConstraint, OneLinearSolutionIsExactWithoutNoiseFromAnywhere) {
  for (const Motion motion : testing::kExcitingMotions) {
    SCOPED_TRACE(testing::toString(motion));
    SyntheticWindowOptions options;
    options.motion = motion;
    const ConstraintCase c(options);
    TranslationConstraint constraint = c.constraint();
    const std::vector<Vector3d> nowhere(c.p.size(), Vector3d::Zero());
    constraint.reweight(nowhere, false);
    const std::vector<Vector3d> p = solved(constraint, nowhere);
    EXPECT_LT(farthest(p, c.p), 1e-8);  // in metres: the cameras' offsets are the scale
    constraint.reweight(p, true);
    constraint.chooseWidestBases();
    constraint.reweight(p, true);
    EXPECT_LT(farthest(solved(constraint, nowhere), c.p), 1e-8);
    EXPECT_LT(constraint.noise(), 1e-6);
  }
}

/** noise() at the true positions with the stereo pairs as bases, and with the widest ones. */
std::pair<double, double> noiseAtTheTruth(double sigma_px) {
  SyntheticWindowOptions options;
  options.motion = Motion::kAggressive;
  options.sigma_px = sigma_px;
  const ConstraintCase c(options);
  TranslationConstraint constraint = c.constraint();
  constraint.reweight(c.p, false);
  const double stereo = constraint.noise();
  constraint.chooseWidestBases();
  constraint.reweight(c.p, false);
  return {stereo, constraint.noise()};
}

TEST(DrtTranslationConstraint, NoiseIsInProportionToThatOfThePixels) {
  const auto [stereo, widest] = noiseAtTheTruth(kSigmaPx);
  // Residuals with one direction only are scaled like those with two, which gives 0.57. From a
  // stereo pair nearly all have one direction, that of the depth's error; from the widest rays only
  // the residuals of the second ray.
  EXPECT_NEAR(stereo, 0.45, 0.1);
  EXPECT_NEAR(widest, 0.8, 0.15);
  const auto [twice_stereo, twice_widest] = noiseAtTheTruth(2.0 * kSigmaPx);
  // The depth of a stereo pair is not linear in its pixels: over 20 seeds its median error grows by
  // a factor of 1.58 to 1.98, that of the widest rays by 1.99 to 2.02.
  EXPECT_NEAR(twice_stereo, 1.78 * stereo, 0.2 * stereo);
  EXPECT_NEAR(twice_widest, 2.0 * widest, 0.05);
}

TEST(DrtTranslationConstraint, RobustWeightsKeepOutliersOut) {
  SyntheticWindowOptions options;
  options.motion = Motion::kAggressive;
  options.outlier_share = 0.1;
  const ConstraintCase c(options);
  const auto error = [&](bool robust) {
    TranslationConstraint constraint = c.constraint();
    std::vector<Vector3d> p(c.p.size(), Vector3d::Zero());
    for (int pass = 0; pass < 30; ++pass) {
      if (pass == 10) constraint.chooseWidestBases();
      constraint.reweight(p, robust && pass > 1);
      p = solved(constraint, p);
    }
    return farthest(p, c.p);
  };
  const double robust = error(true), plain = error(false);
  EXPECT_LT(robust, 0.005);
  EXPECT_LT(robust, 0.1 * plain);
}

TEST(DrtTranslationConstraint, CountsLandmarksWithParallaxAndTheirViews) {
  const ConstraintCase c(small());
  const TranslationConstraint constraint = c.constraint();
  EXPECT_GT(constraint.landmarks(), 10);
  EXPECT_GT(constraint.fewestViews(), 10);
  // Stereo pairs are the first bases, and a baseline of 0.11 m at 3 m and more is not 0.2 rad.
  const TranslationConstraint strict = c.constraint(0.2);
  EXPECT_EQ(strict.landmarks(), 0);
  EXPECT_EQ(strict.fewestViews(), 0);
}

TEST(DrtTranslationConstraint, LandmarksSeenFromOneKeyframeAloneDoNotCount) {
  ConstraintCase c(small());
  LandmarkId id = 0;
  for (TrackedFrame& frame : c.window.frames)
    for (Observation& o : frame.observations) o.id = id++;
  EXPECT_EQ(c.constraint().landmarks(), 0);
}

TEST(DrtTranslationConstraint, ALandmarkWithoutStereoPairGetsABaseInTime) {
  ConstraintCase c(small());
  for (TrackedFrame& frame : c.window.frames)
    for (Observation& o : frame.observations) o.has_right = false;
  TranslationConstraint constraint = c.constraint();
  EXPECT_EQ(constraint.landmarks(), 0);
  constraint.chooseWidestBases();
  EXPECT_GT(constraint.landmarks(), 10);
}

}  // namespace
}  // namespace etalon::plugins
