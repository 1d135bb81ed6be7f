#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <optional>

#include "etalon/core/stopwatch.h"
#include "etalon/initialization/estimation_error.h"
#include "etalon/initialization/initializer.h"
#include "etalon/initialization/steps/combined_rows.h"
#include "etalon/initialization/steps/gyro_bias_of_rotations.h"

namespace etalon::plugins {

using Eigen::Index;
using Eigen::Matrix3d;
using Eigen::MatrixXd;
using Eigen::Vector3d;
using Eigen::VectorXd;

namespace {

/**
 * One equation of a whole window, in which no velocity occurs: the change of velocity from the first
 * to the last pair as the poses have it, less as the IMU has it, 3 x 6(N-1), m/s. With
 * v_k = R_k r_p(k) / dt_k + .. of the two pairs,
 *   R_l r_p(l) / dt_l - R_0 r_p(0) / dt_0 + sum over k < l of R_k r_v(k),   l = N - 2.
 */
MatrixXd deltaVelocity(const std::vector<SE3>& T_VB, const std::vector<Preintegration>& pairs) {
  const Index last = pairs.size() - 1;
  MatrixXd T = MatrixXd::Zero(3, 6 * (last + 1));
  T.middleCols<3>(6 * last) = T_VB[last].R / pairs[last].dt();
  T.leftCols<3>() = -T_VB[0].R / pairs[0].dt();
  for (Index k = 0; k < last; ++k) T.middleCols<3>(6 * k + 3) = T_VB[k].R;
  return T;
}

/** Scales for which | a + s b | = r, the one nearest to 1; nothing if there is none. */
std::optional<double> scaleOf(const Vector3d& a, const Vector3d& b, double r) {
  const double p = a.dot(b) / b.squaredNorm();
  const double q = (a.squaredNorm() - r * r) / b.squaredNorm();
  if (!(p * p >= q)) return std::nullopt;
  const double root = std::sqrt(p * p - q), low = -p - root, high = -p + root;
  return std::abs(low - 1.0) < std::abs(high - 1.0) ? low : high;
}

}  // namespace

/**
 * Gravity, and where it is wanted the scale, from one change of velocity: that of stereo odometry's
 * poses against the accelerometer's (Kneip, Weiss and Siegwart, IROS 2011; README.md beside this
 * file).
 */
class Kneip : public Initializer {
  DEFINE_MRPT_OBJECT(Kneip, etalon::plugins)

 public:
  void declareParameters(ParameterSet& parameters) override {
    parameters.add("free_scale", &free_scale_,
                   "false: the scale is the stereo camera's. true: that at which gravity has its "
                   "magnitude, as with one camera.");
    parameters.add("gyro_passes", &gyro_passes_, {1, 20},
                   "Linear solutions for b_g, at most, each followed by integrating the raw IMU "
                   "anew (the paper has no b_g).");
    parameters.add("max_gravity_deviation_mps2", &max_gravity_deviation_, {0.0, 100.0},
                   "Refuse if gravity at the stereo camera's scale differs from its magnitude by "
                   "more, m/s^2.");
    parameters.add("min_landmarks", &min_landmarks_, {3, 100000},
                   "Refuse if stereo odometry has fewer landmarks in the window.");
  }
  bool needsVisualSolution() const override { return true; }

 protected:
  InitializationResult solve(const InitializationProblem& problem) const override {
    const auto found = visualSolutionWith(problem, min_landmarks_);
    if (!found) return refuse(found.error());
    const VisualSolution& visual = **found;
    if (problem.keyframeCount() < 3)
      return refuse(RefusalStatus::kIllConditioned, Value(problem.keyframeCount()),
                    " keyframes have no change of velocity");
    Stopwatch watch;
    const auto gyro = gyroBiasOfRotations(problem, visual, RowWeights::kImu, gyro_passes_);
    if (!gyro) return refuse(gyro.error());
    const double gyro_ms = watch.lapMilliseconds();
    const VisualFrameEstimate poses = gyro->estimate(problem, visual);
    const CombinedRows equation(problem, gyro->preintegrations, poses,
                                deltaVelocity(poses.T_VB, gyro->preintegrations));
    VisualFrameEstimate estimate = poses;
    if (const auto done = findGravity(problem, equation, &estimate); !done)
      return refuse(done.error());
    Initialization result = alignWithGravity(problem, estimate);
    if (free_scale_) {
      VisualFrameEstimate free = poses;
      if (const auto done = findScale(problem, equation, &free); !done) return refuse(done.error());
      free.errors.reset();  // one equation for two unknowns: its errors are those of the scale
      Initialization scaled = alignWithGravity(problem, free);
      scaled.covariance = covarianceAround(result, scaled);
      result = std::move(scaled);
    }
    result.timings = {{"gyro_bias", gyro_ms}, {"delta_velocity", watch.lapMilliseconds()}};
    return result;
  }

 private:
  /** Gravity and velocities at the scale of the stereo camera. */
  Expected<void> findGravity(const InitializationProblem& problem, const CombinedRows& equation,
                             VisualFrameEstimate* estimate) const {
    const double magnitude = problem.gravityMagnitude();
    // gravity g + scale (s - 1) = y, and the matrix of gravity is a time times the identity.
    const Matrix3d by_y = Matrix3d(equation.gravity).inverse();
    const Vector3d g = by_y * equation.y;
    const auto plausible = checkFreeGravity(g.norm(), magnitude, max_gravity_deviation_);
    if (!plausible) return refuse(plausible.error());
    estimate->g_V = magnitude * g.normalized();
    if (estimate->errors) addGravityErrors(equation, by_y, g, estimate);
    solveVelocities(equation.pairs, nullptr, estimate);
    return {};
  }

  /** The same with the scale at which gravity has its magnitude. */
  static Expected<void> findScale(const InitializationProblem& problem,
                                  const CombinedRows& equation, VisualFrameEstimate* estimate) {
    const double magnitude = problem.gravityMagnitude();
    const Matrix3d by_y = Matrix3d(equation.gravity).inverse();
    Vector3d g = by_y * equation.y;
    const Vector3d path = by_y * equation.scale;  // g = (y - scale (s - 1)) / time
    const auto scale = scaleOf(g + path, -path, magnitude);
    if (!scale)
      return refuse(RefusalStatus::kImplausible,
                    "with no scale does the change of velocity leave gravity its magnitude");
    g -= path * (*scale - 1.0);
    estimate->g_V = magnitude * g.normalized();
    rescale(*scale, equation.camera, estimate);
    solveVelocities(equation.pairs, nullptr, estimate);
    return {};
  }

  static void addGravityErrors(const CombinedRows& equation, const Matrix3d& by_y,
                               const Vector3d& g, VisualFrameEstimate* estimate) {
    StateErrors& errors = *estimate->errors;
    const MatrixXd biases = errors.map.topRows<6>();
    // Its magnitude is set: errors along it go.
    const Vector3d up = g.normalized();
    const Matrix3d across =
        estimate->g_V.norm() / g.norm() * (Matrix3d::Identity() - up * up.transpose());
    CombinedErrors solution;
    solution.accel = biases.bottomRows<3>();
    solution.gravity =
        across * by_y * equation.T * rowErrors(equation.rows, errors.sources, errors.poses, biases);
    addErrors(equation, estimate->T_VB, solution, &errors);
  }

  bool free_scale_ = false;
  int gyro_passes_ = 3;
  double max_gravity_deviation_ = 1.0;
  int min_landmarks_ = 15;
};

IMPLEMENTS_MRPT_OBJECT(Kneip, Initializer, etalon::plugins)

}  // namespace etalon::plugins

ETALON_REGISTER_INITIALIZER(Kneip, etalon::plugins, "kneip", "1.0",
                            "gravity from one change of velocity, camera against accelerometer "
                            "(Kneip et al. 2011)")
