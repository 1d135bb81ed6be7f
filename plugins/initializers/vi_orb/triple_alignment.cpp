#include "triple_alignment.h"

#include <cmath>

#include "etalon/core/so3.h"
#include "etalon/initialization/steps/combined_rows.h"

namespace etalon::plugins {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::Vector3d;
using Eigen::VectorXd;

namespace {

/** Unknowns of the second solution: gravity along its sphere (rad), change of b_a, of the scale. */
enum Unknown : Index { kTilt = 0, kAccel = 2, kScale = 5 };

/** The rows of the triples by those of the pairs, 3(N-2) x 6(N-1). */
MatrixXd triplesOfPairs(const std::vector<SE3>& T_VB, const std::vector<Preintegration>& pairs) {
  const Index triples = pairs.size() - 1;
  MatrixXd T = MatrixXd::Zero(3 * triples, 6 * (triples + 1));
  for (Index k = 0; k < triples; ++k) {
    const double dt = pairs[k].dt(), next_dt = pairs[k + 1].dt();
    T.block<3, 3>(3 * k, 6 * k) = -next_dt * T_VB[k].R;
    T.block<3, 3>(3 * k, 6 * k + 3) = dt * next_dt * T_VB[k].R;
    T.block<3, 3>(3 * k, 6 * k + 6) = dt * T_VB[k + 1].R;
  }
  return T;
}

tl::unexpected<Refusal> notDetermined(const InitializationProblem& problem, double condition,
                                      const TripleAlignmentOptions& options) {
  return refuse(RefusalStatus::kIllConditioned, Value(problem.keyframeCount()),
                " keyframes do not tell gravity from the accelerometer's bias: the condition "
                "number is ",
                Number(condition), ", at most ", Bound(options.max_condition), " is wanted");
}

/** Gravity without b_a, its magnitude free (eq. 12). */
Expected<Vector3d> seedGravity(const InitializationProblem& problem, const CombinedRows& triples,
                               const TripleAlignmentOptions& options) {
  MatrixXd M(triples.y.size(), options.free_scale ? 4 : 3);
  M.leftCols<3>() = triples.gravity;
  if (options.free_scale) M.col(3) = triples.scale;
  const LeastSquares solution(M);
  if (!(solution.condition <= options.max_condition))
    return notDetermined(problem, solution.condition, options);
  const Vector3d free = solution.response.topRows<3>() * triples.y;
  const double magnitude = problem.gravityMagnitude();
  const auto plausible =
      checkFreeGravity(free.norm(), magnitude, options.max_gravity_deviation_mps2);
  if (!plausible) return refuse(plausible.error());
  return magnitude * free.normalized();
}

/** Solution of the second equations, whitened, with the rows of b_a's prior below them. */
struct Refinement {
  MatrixXd g_basis;
  MatrixXd by_rows, by_prior;  ///< by the triples' rows, and by the mean of the prior on b_a
  VectorXd change;
};

Expected<Refinement> refine(const InitializationProblem& problem, const CombinedRows& triples,
                            const TripleAlignmentOptions& options, VisualFrameEstimate* estimate) {
  const Index n = triples.y.size(), unknowns = options.free_scale ? 6 : 5;
  MatrixXd whitening, prior(0, unknowns);
  if (options.weighted && estimate->errors) {
    whitening = whiteningOf(triples, estimate->errors->sources);
    prior = MatrixXd::Zero(3, unknowns);
    prior.middleCols<3>(kAccel).diagonal().setConstant(1.0 / problem.priors().sigma_accel_mps2);
  }
  if (whitening.size() == 0) whitening = MatrixXd::Identity(n, n);
  Refinement r;
  MatrixXd M(n, unknowns), all(n + prior.rows(), unknowns);
  for (int pass = 0; pass < options.passes; ++pass) {
    r.g_basis = problem.gravityMagnitude() * tangentBasis(estimate->g_V);
    M.leftCols<2>() = triples.gravity * r.g_basis;
    M.middleCols<3>(kAccel) = triples.accel;
    if (options.free_scale) M.col(kScale) = triples.scale;
    all << whitening * M, prior;
    const LeastSquares solution(all);
    if (!(solution.condition <= options.max_condition))
      return notDetermined(problem, solution.condition, options);
    r.by_rows = solution.response.leftCols(n) * whitening;
    r.by_prior = solution.response.rightCols(prior.rows()) * prior.middleCols(kAccel, 3);
    r.change = r.by_rows * (triples.y - triples.gravity * estimate->g_V);
    estimate->g_V =
        problem.gravityMagnitude() * (estimate->g_V + r.g_basis * r.change.head<2>()).normalized();
  }
  return r;
}

}  // namespace

Expected<void> alignTriples(const InitializationProblem& problem,
                            const std::vector<Preintegration>& preintegrations,
                            const TripleAlignmentOptions& options, VisualFrameEstimate* estimate) {
  if (preintegrations.size() < 2) return notDetermined(problem, INFINITY, options);
  const CombinedRows triples(problem, preintegrations, *estimate,
                             triplesOfPairs(estimate->T_VB, preintegrations));
  const auto seed = seedGravity(problem, triples, options);
  if (!seed) return refuse(seed.error());
  estimate->g_V = *seed;
  const auto refined = refine(problem, triples, options, estimate);
  if (!refined) return refuse(refined.error());
  if (estimate->errors) {
    StateErrors& errors = *estimate->errors;
    MatrixXd biases = MatrixXd::Zero(6, errors.map.cols());
    biases.topRows<3>() = errors.map.topRows<3>();
    MatrixXd solution = refined->by_rows * triples.errors(errors.sources, biases);
    if (refined->by_prior.size() > 0)
      solution += refined->by_prior * errors.sources.priorMean().bottomRows<3>();
    addErrors(triples, preintegrations, estimate->T_VB, solution.middleRows<3>(kAccel),
              refined->g_basis * solution.topRows<2>(),
              options.free_scale ? MatrixXd(solution.row(kScale)) : MatrixXd(), &errors);
  }
  estimate->bias.accel += refined->change.segment<3>(kAccel);
  if (options.free_scale) rescale(1.0 + refined->change[kScale], triples.camera, estimate);
  solveVelocities(preintegrations, estimate);
  return {};
}

}  // namespace etalon::plugins
