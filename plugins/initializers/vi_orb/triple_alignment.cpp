#include "triple_alignment.h"

#include <Eigen/Cholesky>
#include <Eigen/SVD>
#include <cmath>

#include "etalon/core/so3.h"

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

/** Least squares of M z = y by the singular values, columns scaled to unit length. */
struct LeastSquares {
  MatrixXd response;  ///< dz/dy
  double condition = INFINITY;

  explicit LeastSquares(const MatrixXd& M) {
    if (M.rows() < M.cols()) return;
    const VectorXd scale = M.colwise().norm().cwiseInverse();
    if (!scale.allFinite()) return;
    const Eigen::JacobiSVD<MatrixXd> svd(M * scale.asDiagonal(),
                                         Eigen::ComputeThinU | Eigen::ComputeThinV);
    const VectorXd& values = svd.singularValues();
    if (!(values[values.size() - 1] > 0.0)) return;
    condition = values[0] / values[values.size() - 1];
    response = scale.asDiagonal() * svd.matrixV() * values.cwiseInverse().asDiagonal() *
               svd.matrixU().transpose();
  }
};

/** The equations of a window: triples of r = y - gravity g - accel db_a - scale ds. */
struct Triples {
  Triples(const InitializationProblem& problem, const std::vector<Preintegration>& pairs,
          const VisualFrameEstimate& estimate)
      : rows(linearAlignmentRows(estimate.T_VB, pairs, estimate.bias)),
        T(triplesOfPairs(estimate.T_VB, pairs)),
        pair_scale(VectorXd::Zero(rows.y.size())) {
    for (const SE3& T_VB : estimate.T_VB)
      camera.push_back(T_VB * problem.calibration().cameras[0].T_BC.t);
    for (size_t k = 0; k < pairs.size(); ++k)
      pair_scale.segment<3>(6 * k) =
          -(estimate.T_VB[k].R.transpose() * (camera[k + 1] - camera[k]));
    gravity = T * rows.A.rightCols<3>();
    accel = T * rows.by_bias.rightCols<3>();
    scale = T * pair_scale;
    y = T * rows.y;
  }

  LinearAlignmentRows rows;  ///< of the pairs
  MatrixXd T;
  std::vector<Vector3d> camera;  ///< p_VC, left
  VectorXd pair_scale;           ///< what the pairs' rows have for ds
  MatrixXd gravity, accel;
  VectorXd scale, y;
};

/** Weights of the second solution's rows, and the prior's rows below them. */
struct Weights {
  MatrixXd rows;      ///< W, of the triples
  MatrixXd of_prior;  ///< 3 x unknowns; empty: none
  double inverse_sigma = 0.0;

  MatrixXd stacked(const MatrixXd& M) const {
    MatrixXd all(M.rows() + of_prior.rows(), M.cols());
    all << rows * M, of_prior;
    return all;
  }
};

Weights weightsOf(const InitializationProblem& problem, const Triples& triples,
                  const VisualFrameEstimate& estimate, const TripleAlignmentOptions& options) {
  const Index n = triples.y.size();
  Weights weights{MatrixXd::Identity(n, n), MatrixXd(0, options.free_scale ? 6 : 5), 0.0};
  if (!options.weighted || !estimate.errors) return weights;
  const ErrorSources& sources = estimate.errors->sources;
  const MatrixXd biases = MatrixXd::Zero(6, sources.poses().cols());
  const MatrixXd errors = triples.T * rowErrors(triples.rows, sources, sources.poses(), biases);
  const Eigen::LLT<MatrixXd> noise(sources.covarianceOf(errors));
  if (noise.info() != Eigen::Success) return weights;
  weights.rows = noise.matrixL().solve(weights.rows);
  weights.inverse_sigma = 1.0 / problem.priors().sigma_accel_mps2;
  weights.of_prior = MatrixXd::Zero(3, weights.of_prior.cols());
  weights.of_prior.middleCols<3>(kAccel).diagonal().setConstant(weights.inverse_sigma);
  return weights;
}

/** Velocities at which the pairs' positions fit; the last one's by its interval's dv. */
void solveVelocities(const std::vector<Preintegration>& pairs, VisualFrameEstimate* estimate) {
  const std::vector<SE3>& T_VB = estimate->T_VB;
  const Vector3d& g = estimate->g_V;
  for (size_t k = 0; k < pairs.size(); ++k) {
    const double dt = pairs[k].dt();
    const Preintegration::Deltas d = pairs[k].corrected(estimate->bias);
    estimate->v_VB.emplace_back((T_VB[k + 1].t - T_VB[k].t - T_VB[k].R * d.dp - 0.5 * dt * dt * g) /
                                dt);
    if (k + 1 == pairs.size())
      estimate->v_VB.emplace_back(estimate->v_VB[k] + g * dt + T_VB[k].R * d.dv);
  }
}

/** Errors of b_a, gravity and velocities behind those of b_g; `errors` of the second solution. */
void addErrors(const Triples& triples, const std::vector<Preintegration>& pairs,
               const std::vector<SE3>& T_VB, const MatrixXd& g_basis, const MatrixXd& solution,
               StateErrors* errors) {
  const Index N = T_VB.size();
  MatrixXd map(StateErrors::kVelocity + 3 * N, solution.cols());
  map.topRows<3>() = errors->map.topRows<3>();
  map.middleRows<3>(StateErrors::kAccel) = solution.middleRows<3>(kAccel);
  map.middleRows<3>(StateErrors::kGravity) = g_basis * solution.topRows<2>();
  const auto gravity = map.middleRows<3>(StateErrors::kGravity);
  MatrixXd rows =
      rowErrors(triples.rows, errors->sources, errors->sources.poses(), map.topRows<6>());
  if (solution.rows() > kScale) rows -= triples.pair_scale * solution.row(kScale);
  for (Index k = 0; k + 1 < N; ++k) {
    const double dt = pairs[k].dt();
    map.middleRows<3>(StateErrors::kVelocity + 3 * k) =
        T_VB[k].R * rows.middleRows<3>(6 * k) / dt - 0.5 * dt * gravity;
  }
  const double dt = pairs.back().dt();
  map.bottomRows<3>() =
      map.middleRows<3>(map.rows() - 6) + dt * gravity - T_VB[N - 2].R * rows.bottomRows<3>();
  errors->map = std::move(map);
}

tl::unexpected<Refusal> notDetermined(const InitializationProblem& problem, double condition,
                                      const TripleAlignmentOptions& options) {
  return refuse(RefusalStatus::kIllConditioned, Value(problem.keyframeCount()),
                " keyframes do not tell gravity from the accelerometer's bias: the condition "
                "number is ",
                Number(condition), ", at most ", Bound(options.max_condition), " is wanted");
}

/** Moves positions and landmarks as the left camera's path is `factor` times as long. */
void rescale(double factor, const std::vector<Vector3d>& camera, VisualFrameEstimate* estimate) {
  for (size_t k = 0; k < camera.size(); ++k)
    estimate->T_VB[k].t += (factor - 1.0) * (camera[k] - camera[0]);
  for (auto& [id, p_V] : estimate->landmarks) p_V += (factor - 1.0) * (p_V - camera[0]);
}

}  // namespace

Expected<void> alignTriples(const InitializationProblem& problem,
                            const std::vector<Preintegration>& preintegrations,
                            const TripleAlignmentOptions& options, VisualFrameEstimate* estimate) {
  if (preintegrations.size() < 2) return notDetermined(problem, INFINITY, options);
  const double magnitude = problem.gravityMagnitude();
  const Triples triples(problem, preintegrations, *estimate);
  const Index n = triples.y.size(), unknowns = options.free_scale ? 6 : 5;

  MatrixXd first(n, unknowns - 2);
  first.leftCols<3>() = triples.gravity;
  if (options.free_scale) first.col(3) = triples.scale;
  const LeastSquares seed(first);
  if (!(seed.condition <= options.max_condition))
    return notDetermined(problem, seed.condition, options);
  const Vector3d free = seed.response.topRows<3>() * triples.y;
  if (const auto plausible =
          checkFreeGravity(free.norm(), magnitude, options.max_gravity_deviation_mps2);
      !plausible)
    return plausible;
  estimate->g_V = magnitude * free.normalized();

  const Weights weights = weightsOf(problem, triples, *estimate, options);
  MatrixXd M(n, unknowns), g_basis;
  MatrixXd response;
  VectorXd change;
  for (int pass = 0; pass < options.passes; ++pass) {
    g_basis = magnitude * tangentBasis(estimate->g_V);
    M.leftCols<2>() = triples.gravity * g_basis;
    M.middleCols<3>(kAccel) = triples.accel;
    if (options.free_scale) M.col(kScale) = triples.scale;
    const LeastSquares solution(weights.stacked(M));
    if (!(solution.condition <= options.max_condition))
      return notDetermined(problem, solution.condition, options);
    response = solution.response;
    change = response.leftCols(n) * (weights.rows * (triples.y - triples.gravity * estimate->g_V));
    estimate->g_V = magnitude * (estimate->g_V + g_basis * change.head<2>()).normalized();
  }
  if (estimate->errors) {
    const ErrorSources& sources = estimate->errors->sources;
    MatrixXd biases = MatrixXd::Zero(6, sources.poses().cols());
    biases.topRows<3>() = estimate->errors->map.topRows<3>();
    MatrixXd solution = response.leftCols(n) * weights.rows * triples.T *
                        rowErrors(triples.rows, sources, sources.poses(), biases);
    if (weights.inverse_sigma > 0.0)
      solution +=
          weights.inverse_sigma * response.rightCols<3>() * sources.priorMean().bottomRows<3>();
    addErrors(triples, preintegrations, estimate->T_VB, g_basis, solution, &*estimate->errors);
  }
  estimate->bias.accel += change.segment<3>(kAccel);
  if (options.free_scale) rescale(1.0 + change[kScale], triples.camera, estimate);
  solveVelocities(preintegrations, estimate);
  return {};
}

}  // namespace etalon::plugins
