#include <optional>

#include "etalon/core/stopwatch.h"
#include "etalon/initialization/estimation_error.h"
#include "etalon/initialization/initializer.h"
#include "etalon/initialization/steps/gravity_alignment.h"
#include "etalon/initialization/steps/linear_alignment.h"
#include "etalon/initialization/steps/normal_epipolar_step.h"
#include "etalon/initialization/steps/translation_step.h"
#include "etalon/optimization/bundle/normal_equations.h"
#include "imu_alignment.h"
#include "reprojection_refinement.h"
#include "translation_constraint.h"

namespace etalon::plugins {

using Eigen::Matrix3d;
using Eigen::Vector3d;

/**
 * DRT, the rotation-translation-decoupled solution (He et al., CVPR 2023) for a stereo camera: gyro
 * bias from normal epipolar constraints, then positions, velocities and gravity from the linear
 * global translation constraint of the tracks, tightly or loosely coupled with the accelerometer
 * (README.md beside this file).
 */
class Drt : public Initializer {
  DEFINE_MRPT_OBJECT(Drt, etalon::plugins)

 public:
  void declareParameters(ParameterSet& parameters) override {
    parameters.add("variant", &tight_, {{"tight", true}, {"loose", false}},
                   "Translation constraint and IMU solved together, or positions by the constraint "
                   "alone and velocities and gravity by linear alignment after it.");
    parameters.add(
        "accel_bias", &estimate_accel_bias_, {{"prior", true}, {"mean", false}},
        "b_a in the tight variant: estimated with the prior of [priors], or fixed at its "
        "mean (as published, zero). The loose one fixes it.");
    parameters.add(
        "weighting", &robust_, {{"robust", true}, {"none", false}},
        "Rows of the constraint weighted by noise and residual (robust), or by noise alone.");
    parameters.add("passes", &passes_, {5, 100},
                   "Linear solutions, at most; between two the rows are weighted anew. The "
                   "refinement may take three times as many.");
    parameters.add("min_parallax_rad", &min_parallax_rad_, {1e-6, 1.0},
                   "A landmark whose views differ by a smaller angle is left out, rad.");
    parameters.add("min_landmarks", &min_landmarks_, {3, 100000},
                   "Refuse if fewer landmarks are left, or if fewer views of a keyframe.");
    parameters.add("max_noise", &max_noise_, {0.0, 1e9},
                   "Refuse if the constraint's residuals are larger than this many times what "
                   "sigma_px promises.");
    parameters.add("refine", &refine_,
                   "Take the linear solution on to the least reprojection error, rotations held; "
                   "false: as published, off by the square of the pixels' noise.");
    nec_.declare(parameters);
  }
  bool needsVisualSolution() const override { return false; }

 protected:
  InitializationResult solve(const InitializationProblem& problem) const override {
    Stopwatch watch;
    ImuBias bias = problem.priors().mean;
    std::vector<Preintegration> preintegrations = problem.preintegrate(bias);
    const Expected<NormalEpipolarBias> nec =
        solveNormalEpipolarStep(problem, preintegrations, bias.gyro, nec_);
    if (!nec) return refuse(nec.error());
    bias.gyro = nec->gyro;
    for (Preintegration& p : preintegrations) p = p.reintegrated(bias);
    const std::vector<Matrix3d> R_VB =
        integrateRotations(Matrix3d::Identity(), preintegrations, bias);
    const double nec_ms = watch.lapMilliseconds();

    TranslationConstraint constraint(problem.calibration(), problem.keyframes(), R_VB,
                                     problem.sigmaPx(), min_parallax_rad_);
    const int support = std::min(constraint.landmarks(), constraint.fewestViews());
    if (support < min_landmarks_)
      return refuse(RefusalStatus::kTooFewTracks, Value(support),
                    " landmarks with parallax support the translation of the weakest keyframe, at "
                    "least ",
                    Bound(min_landmarks_), " are wanted");
    if (const auto down = checkMeanSpecificForce(meanSpecificForce(R_VB, preintegrations),
                                                 problem.gravityMagnitude());
        !down)
      return refuse(down.error());
    const ImuAlignment imu(R_VB, preintegrations, problem.gravityMagnitude(),
                           problem.priors().mean.accel, problem.priors().sigma_accel_mps2,
                           !estimate_accel_bias_);
    LinearState state = imu.start();
    const SolverSummary linear = solvePasses(imu, &constraint, &state);
    if (!linear.usable())
      return refuse(RefusalStatus::kIllConditioned, linear.message, " (pass ",
                    Value(linear.iterations), " of ", passes_, ")");
    if (!(constraint.noise() <= max_noise_))
      return refuse(RefusalStatus::kNotConverged, "the translation residuals are ",
                    Value(constraint.noise(), 1), " times what sigma_px promises, at most ",
                    Bound(max_noise_, 1), " is wanted");
    ReprojectionRefinement refinement(problem, R_VB);
    if (refine_ && !refinement.refine(tight_ ? &imu : nullptr, 3 * passes_, &state).converged())
      return refuse(RefusalStatus::kNotConverged, "the reprojection errors of ",
                    refinement.landmarks(), " landmarks did not come to rest in ",
                    Value(3 * passes_), " passes");
    const Window window{problem, preintegrations, bias, R_VB, *nec};
    const LinearState linear_state = state;
    if (!tight_) {
      const auto aligned = align(window, &state);
      if (!aligned) return refuse(aligned.error());
    }
    Initialization result;
    if (refine_) {
      result = withCovariance(window, imu, refinement, state);
    } else {
      result = alignWithGravity(problem, estimateOf(R_VB, state, bias.gyro));
      result.covariance = covarianceOfLinear(window, linear_state, result, &refinement);
    }
    result.timings = {{"normal_epipolar", nec_ms}, {"translation", watch.lapMilliseconds()}};
    return result;
  }

 private:
  /** Norm of the mean specific force in V, m/s^2. */
  static double meanSpecificForce(const std::vector<Matrix3d>& R_VB,
                                  const std::vector<Preintegration>& preintegrations) {
    Vector3d sum = Vector3d::Zero();
    double duration = 0.0;
    for (size_t k = 0; k < preintegrations.size(); ++k) {
      sum += R_VB[k] * preintegrations[k].deltas().dv;
      duration += preintegrations[k].dt();
    }
    return sum.norm() / duration;
  }

  static VisualFrameEstimate estimateOf(const std::vector<Matrix3d>& R_VB, const LinearState& state,
                                        const Vector3d& b_g) {
    VisualFrameEstimate estimate;
    for (size_t k = 0; k < R_VB.size(); ++k) estimate.T_VB.emplace_back(R_VB[k], state.p[k]);
    estimate.v_VB = state.v;
    estimate.g_V = state.g_V;
    estimate.bias = {b_g, state.b_a};
    return estimate;
  }

  /** Solves for the positions, in the tight variant for the whole state. The final weights are not
   * robust. Costs are not computed. */
  SolverSummary solvePasses(const ImuAlignment& imu, TranslationConstraint* constraint,
                            LinearState* state) const {
    const Eigen::Index n = 3 * state->p.size();
    constexpr double kConverged = 1e-4;  // m, a tenth of what vision resolves
    constexpr int kWithStereoBases = 4;
    SolverSummary summary;
    summary.termination = Termination::kMaxIterations;
    for (int pass = 0; pass < passes_; ++pass) {
      ++summary.iterations;
      if (pass == kWithStereoBases) constraint->chooseWidestBases();
      constraint->reweight(state->p, pass > 1 && robust_);
      Eigen::MatrixXd H = Eigen::MatrixXd::Zero(imu.size(), imu.size());
      Eigen::VectorXd gradient = Eigen::VectorXd::Zero(imu.size());
      constraint->addTo(state->p, &H, &gradient);
      // The first position is the gauge; the loose variant knows positions alone.
      if (tight_) imu.addTo(*state, &H, &gradient);
      const Eigen::Index size = (tight_ ? imu.size() : n) - 3;
      const ScaledCholesky factor(H.block(3, 3, size, size));
      Eigen::VectorXd step = Eigen::VectorXd::Zero(imu.size());
      if (factor.determined()) step.segment(3, size) = factor.solve(-gradient.segment(3, size));
      if (!factor.determined() || !step.allFinite()) {
        summary.stop(Termination::kSingular, "the tracks do not determine the translations");
        return summary;
      }
      *state = imu.moved(*state, step);
      if (pass <= kWithStereoBases || step.head(n).lpNorm<Eigen::Infinity>() >= kConverged)
        continue;
      summary.termination = Termination::kConverged;
      break;
    }
    constraint->reweight(state->p, false);
    return summary;
  }

  /** What all solutions have in common. */
  struct Window {
    const InitializationProblem& problem;
    const std::vector<Preintegration>& preintegrations;
    const ImuBias& bias;
    const std::vector<Matrix3d>& R_VB;
    const NormalEpipolarBias& gyro_bias;
  };

  /** Velocities and gravity of the loose variant from its positions. */
  static Expected<void> align(const Window& window, LinearState* state) {
    const VisualFrameEstimate poses = estimateOf(window.R_VB, *state, window.bias.gyro);
    const LinearAlignmentResult aligned =
        alignVelocitiesAndGravity(poses.T_VB, window.preintegrations, window.bias,
                                  window.problem.gravityMagnitude(), state->g_V);
    if (!aligned.summary.usable())
      return refuse(RefusalStatus::kIllConditioned, "velocities and gravity are not determined by ",
                    Value(window.R_VB.size()), " positions");
    state->v = aligned.v_VB;
    state->g_V = aligned.g_V;
    state->b_a = window.bias.accel;
    return {};
  }

  /** A refined solution with its covariance. */
  Initialization withCovariance(const Window& window, const ImuAlignment& imu,
                                const ReprojectionRefinement& refinement,
                                const LinearState& state) const {
    VisualFrameEstimate estimate = estimateOf(window.R_VB, state, window.bias.gyro);
    if (!tight_) estimate.errors = looseErrors(window, estimate, refinement.positionErrors());
    Initialization result = alignWithGravity(window.problem, estimate);
    if (tight_) result.covariance = refinement.covariance(imu, state, window.gyro_bias.covariance);
    return result;
  }

  /**
   * The linear solution is off by what two steps of the refinement move it: the square of what is
   * left is nothing. b_a is then estimated with its prior, whether it was held or not.
   */
  Eigen::MatrixXd covarianceOfLinear(const Window& window, LinearState state,
                                     const Initialization& linear,
                                     ReprojectionRefinement* refinement) const {
    const BiasPriors& priors = window.problem.priors();
    const ImuAlignment imu(window.R_VB, window.preintegrations, window.problem.gravityMagnitude(),
                           priors.mean.accel, priors.sigma_accel_mps2);
    constexpr int kSteps = 2;
    const SolverSummary steps = refinement->refine(tight_ ? &imu : nullptr, kSteps, &state);
    if (!steps.usable() || (!tight_ && !align(window, &state))) return {};
    return covarianceAround(withCovariance(window, imu, *refinement, state), linear);
  }

  /** The gyro turns the poses, positions follow, and the linear alignment takes up both. */
  static std::optional<StateErrors> looseErrors(
      const Window& window, const VisualFrameEstimate& estimate,
      const std::optional<ReprojectionRefinement::PositionErrors>& positions) {
    if (!positions) return std::nullopt;
    StateErrors errors{ErrorSources(window.problem, window.preintegrations, positions->covariance,
                                    window.gyro_bias.errors),
                       {}};
    errors.map = errors.sources.priorMean();
    errors.map.topRows<3>() = errors.sources.measuredGyroBias();
    errors.poses = gyroPoseErrors(window.preintegrations, positions->by_rotation, errors);
    if (!alignErrors(estimate.T_VB, window.preintegrations, window.bias, {}, estimate.g_V,
                     errors.poses, &errors))
      return std::nullopt;
    return errors;
  }

  bool tight_ = true;
  bool estimate_accel_bias_ = true;
  bool robust_ = true;
  int passes_ = 12;
  double min_parallax_rad_ = 0.01;
  int min_landmarks_ = 15;
  double max_noise_ = 5.0;
  bool refine_ = true;
  NormalEpipolarStepOptions nec_;
};

IMPLEMENTS_MRPT_OBJECT(Drt, Initializer, etalon::plugins)

}  // namespace etalon::plugins

ETALON_REGISTER_INITIALIZER(
    Drt, etalon::plugins, "drt", "1.1",
    "rotation-translation-decoupled: normal epipolar gyro bias, linear translations (DRT)")
