#include "etalon/initialization/steps/combined_rows.h"

#include <Eigen/Cholesky>
#include <Eigen/SVD>
#include <cmath>
#include <utility>

#include "etalon/core/so3.h"
#include "etalon/initialization/predicted_errors.h"

namespace etalon {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::Vector3d;
using Eigen::VectorXd;

void CombinedRowsOptions::declare(ParameterSet& parameters) {
  parameters.add("weighted", &weighted,
                 "false: the equations as they are, b_a without a prior. true: weighted by the "
                 "covariance of IMU and stereo odometry, with the prior on b_a.");
  parameters.add("gravity_passes", &passes, {1, 100},
                 "Solutions for gravity's direction and b_a, each linearised at the last one.");
  parameters.add("max_condition", &max_condition, {1.0, 1e12},
                 "Refuse if the condition number of the equations, columns of unit length, is "
                 "larger.");
  parameters.add("max_gravity_deviation_mps2", &max_gravity_deviation_mps2, {0.0, 100.0},
                 "Refuse if gravity, its magnitude free and b_a the mean of its prior, differs "
                 "from its magnitude by more, m/s^2.");
  parameters.add("max_sigma_gravity_deg", &max_sigma_gravity_deg, {0.0, 180.0},
                 "Refuse if the standard deviation of gravity's direction is larger, deg.");
}

void CombinedRowsOptions::declareScale(ParameterSet& parameters) {
  parameters.add("free_scale", &free_scale,
                 "false: the scale is the stereo camera's. true: it is an unknown, as with one "
                 "camera.");
}

namespace {

/** Unknowns of the second solution: gravity along its sphere (rad), change of b_a; then what is
 * wanted of v_0, the change of the scale and x. */
enum CommonUnknown : Index { kTilt = 0, kAccel = 2, kOthers = 5 };

/** dz/dy of the least-squares solution of M z = y, by singular values. */
struct LeastSquares {
  MatrixXd response;
  double condition = INFINITY;  ///< of M with columns of unit length; infinite: not determined

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

/** Columns of what is wanted besides gravity and b_a. */
MatrixXd otherColumns(const CombinedRows& rows, const CombinedRowsOptions& options) {
  const Index velocity = options.first_velocity ? 3 : 0, scale = options.free_scale ? 1 : 0;
  MatrixXd others(rows.y.size(), velocity + scale + rows.extra.cols());
  if (options.first_velocity) others.leftCols<3>() = rows.first_velocity;
  if (options.free_scale) others.col(velocity) = rows.scale;
  others.rightCols(rows.extra.cols()) = rows.extra;
  return others;
}

tl::unexpected<Refusal> notDetermined(const InitializationProblem& problem, double condition,
                                      const CombinedRowsOptions& options) {
  return refuse(RefusalStatus::kIllConditioned, Value(problem.keyframeCount()),
                " keyframes do not tell gravity from the accelerometer's bias: the condition "
                "number is ",
                Number(condition), ", at most ", Bound(options.max_condition),
                " is wanted: tilt, or accelerate sideways");
}

/** Gravity without b_a, its magnitude free. */
Expected<Vector3d> seedGravity(const InitializationProblem& problem, const CombinedRows& rows,
                               const MatrixXd& others, const CombinedRowsOptions& options) {
  MatrixXd M(rows.y.size(), 3 + others.cols());
  M << rows.gravity, others;
  const LeastSquares solution(M);
  if (!(solution.condition <= options.max_condition))
    return notDetermined(problem, solution.condition, options);
  const Vector3d free = solution.response.topRows<3>() * rows.y;
  const double magnitude = problem.gravityMagnitude();
  const auto plausible =
      checkFreeGravity(free.norm(), magnitude, options.max_gravity_deviation_mps2);
  if (!plausible) return refuse(plausible.error());
  return magnitude * free.normalized();
}

MatrixXd errorsOf(const CombinedRows& rows, const StateErrors& errors,
                  const MatrixXd& bias_errors) {
  return rows.T * rowErrors(rows.rows, errors.sources, errors.poses, bias_errors);
}

/** W such that W^T W is the inverse covariance of T r with exact biases; the identity if that is
 * singular. */
MatrixXd whiteningOf(const CombinedRows& rows, const StateErrors& errors) {
  const MatrixXd exact = MatrixXd::Zero(6, errors.map.cols());
  const MatrixXd identity = MatrixXd::Identity(rows.y.size(), rows.y.size());
  const Eigen::LLT<MatrixXd> noise(errors.sources.covarianceOf(errorsOf(rows, errors, exact)));
  return noise.info() == Eigen::Success ? MatrixXd(noise.matrixL().solve(identity)) : identity;
}

/** Of the second solution. */
struct Refinement {
  MatrixXd g_by_tilt;          ///< of gravity's error by that of the first two unknowns, 3 x 2
  MatrixXd by_rows, by_prior;  ///< by T r, and by the mean of the prior on b_a
  VectorXd change;
};

/** d(magnitude g / |g|)/dg. */
Eigen::Matrix3d alongSphere(const Vector3d& g, double magnitude) {
  const Vector3d down = g.normalized();
  return magnitude / g.norm() * (Eigen::Matrix3d::Identity() - down * down.transpose());
}

/** The error of gravity is a chord of its sphere, from the truth to the estimate. Where b_a has no
 * prior it is far longer than the step's start is from the truth, so the chord has the direction
 * that the sphere has halfway along the step. */
Expected<Refinement> refine(const InitializationProblem& problem, const CombinedRows& rows,
                            const MatrixXd& others, const CombinedRowsOptions& options,
                            VisualFrameEstimate* estimate) {
  const Index n = rows.y.size(), unknowns = kOthers + others.cols();
  MatrixXd whitening = MatrixXd::Identity(n, n), prior(0, unknowns);
  if (options.weighted && estimate->errors) {
    whitening = whiteningOf(rows, *estimate->errors);
    prior = MatrixXd::Zero(3, unknowns);
    prior.middleCols<3>(kAccel).diagonal().setConstant(1.0 / problem.priors().sigma_accel_mps2);
  }
  Refinement r;
  MatrixXd M(n, unknowns), all(n + prior.rows(), unknowns);
  M.rightCols(others.cols()) = others;
  M.middleCols<3>(kAccel) = rows.accel;
  const double magnitude = problem.gravityMagnitude();
  for (int pass = 0; pass < options.passes; ++pass) {
    const MatrixXd basis = magnitude * tangentBasis(estimate->g_V);
    M.leftCols<2>() = rows.gravity * basis;
    all << whitening * M, prior;
    const LeastSquares solution(all);
    if (!(solution.condition <= options.max_condition))
      return notDetermined(problem, solution.condition, options);
    r.by_rows = solution.response.leftCols(n) * whitening;
    r.by_prior = solution.response.rightCols(prior.rows()) * prior.middleCols(kAccel, 3);
    r.change = r.by_rows * (rows.y - rows.gravity * estimate->g_V);
    r.g_by_tilt = alongSphere(estimate->g_V + 0.5 * basis * r.change.head<2>(), magnitude) * basis;
    estimate->g_V = magnitude * (estimate->g_V + basis * r.change.head<2>()).normalized();
  }
  return r;
}

CombinedErrors errorsOf(const Refinement& refined, const CombinedRows& rows,
                        const CombinedRowsOptions& options, const StateErrors& errors) {
  MatrixXd biases = MatrixXd::Zero(6, errors.map.cols());
  biases.topRows<3>() = errors.map.topRows<3>();
  MatrixXd solution = refined.by_rows * errorsOf(rows, errors, biases);
  if (refined.by_prior.size() > 0)
    solution += refined.by_prior * errors.sources.priorMean().bottomRows<3>();
  CombinedErrors result;
  result.accel = solution.middleRows<3>(kAccel);
  result.gravity = refined.g_by_tilt * solution.topRows<2>();
  Index at = kOthers;
  if (options.first_velocity) {
    result.first_velocity = solution.middleRows<3>(at);
    at += 3;
  }
  if (options.free_scale) result.scale = solution.row(at++);
  result.extra = solution.bottomRows(solution.rows() - at);
  return result;
}

}  // namespace

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

MatrixXd positionsOfPairs(const std::vector<SE3>& T_VB, const std::vector<Preintegration>& pairs) {
  const Index n = pairs.size();
  MatrixXd T = MatrixXd::Zero(3 * n, 6 * n);
  for (Index k = 0; k < n; ++k) {
    double after = 0.0;  // t_k+1 - t_j+1
    for (Index j = k; j >= 0; --j) {
      T.block<3, 3>(3 * k, 6 * j) = T_VB[j].R;
      T.block<3, 3>(3 * k, 6 * j + 3) = after * T_VB[j].R;
      after += pairs[j].dt();
    }
  }
  return T;
}

CombinedRows::CombinedRows(const InitializationProblem& problem,
                           const std::vector<Preintegration>& preintegrations,
                           const VisualFrameEstimate& estimate, MatrixXd combination,
                           MatrixXd extra_columns)
    : pairs(preintegrations),
      rows(linearAlignmentRows(estimate.T_VB, pairs, estimate.bias)),
      T(std::move(combination)),
      pair_scale(VectorXd::Zero(rows.y.size())),
      pair_extra(std::move(extra_columns)) {
  if (pair_extra.cols() == 0) pair_extra.resize(rows.y.size(), 0);
  for (const SE3& T_VB : estimate.T_VB)
    camera.push_back(T_VB * problem.calibration().cameras[0].T_BC.t);
  for (size_t k = 0; k < pairs.size(); ++k)
    pair_scale.segment<3>(6 * k) = -(estimate.T_VB[k].R.transpose() * (camera[k + 1] - camera[k]));
  first_velocity = T * rows.A.leftCols<3>();
  gravity = T * rows.A.rightCols<3>();
  accel = T * rows.by_bias.rightCols<3>();
  scale = T * pair_scale;
  extra = T * pair_extra;
  y = T * rows.y;
}

Expected<CombinedExtra> solveCombinedRows(const InitializationProblem& problem,
                                          const CombinedRows& rows,
                                          const CombinedRowsOptions& options,
                                          VisualFrameEstimate* estimate) {
  const MatrixXd others = otherColumns(rows, options);
  const auto seed = seedGravity(problem, rows, others, options);
  if (!seed) return refuse(seed.error());
  estimate->g_V = *seed;
  const auto refined = refine(problem, rows, others, options, estimate);
  if (!refined) return refuse(refined.error());
  const VectorXd& change = refined->change;
  CombinedExtra own = {change.tail(rows.extra.cols()), {}};
  if (estimate->errors) {
    CombinedErrors errors = errorsOf(*refined, rows, options, *estimate->errors);
    const double sigma = largestSigma(estimate->errors->sources.covarianceOf(errors.gravity)) /
                         problem.gravityMagnitude();
    if (const auto known = checkGravityDirection(sigma, options.max_sigma_gravity_deg); !known)
      return refuse(known.error());
    addErrors(rows, estimate->T_VB, errors, &*estimate->errors);
    own.errors = std::move(errors.extra);
  }
  estimate->bias.accel += change.segment<3>(kAccel);
  const Index scale_at = kOthers + (options.first_velocity ? 3 : 0);
  if (options.free_scale) rescale(1.0 + change[scale_at], rows.camera, estimate);
  const Vector3d first = options.first_velocity ? Vector3d(change.segment<3>(kOthers)) : Vector3d();
  solveVelocities(rows.pairs, options.first_velocity ? &first : nullptr, estimate);
  return own;
}

void solveVelocities(const std::vector<Preintegration>& pairs, const Vector3d* first,
                     VisualFrameEstimate* estimate) {
  const std::vector<SE3>& T_VB = estimate->T_VB;
  std::vector<Vector3d>& v = estimate->v_VB;
  v.clear();
  if (first) v.push_back(*first);
  for (size_t k = 0; k < pairs.size(); ++k) {
    const double dt = pairs[k].dt();
    const Preintegration::Deltas d = pairs[k].corrected(estimate->bias);
    if (!first)
      v.emplace_back(
          (T_VB[k + 1].t - T_VB[k].t - T_VB[k].R * d.dp - 0.5 * dt * dt * estimate->g_V) / dt);
    if (first || k + 1 == pairs.size())
      v.emplace_back(v[k] + estimate->g_V * dt + T_VB[k].R * d.dv);
  }
}

void addErrors(const CombinedRows& rows, const std::vector<SE3>& T_VB,
               const CombinedErrors& solution, StateErrors* errors) {
  const Index N = T_VB.size();
  MatrixXd map(StateErrors::kVelocity + 3 * N, errors->map.cols());
  map.topRows<3>() = errors->map.topRows<3>();
  map.middleRows<3>(StateErrors::kAccel) = solution.accel;
  map.middleRows<3>(StateErrors::kGravity) = solution.gravity;
  MatrixXd of_rows = rowErrors(rows.rows, errors->sources, errors->poses, map.topRows<6>());
  if (solution.scale.size() > 0) of_rows -= rows.pair_scale * solution.scale;
  if (solution.extra.size() > 0) of_rows -= rows.pair_extra * solution.extra;
  const bool integrated = solution.first_velocity.size() > 0;
  const auto velocity = [&](Index k) { return map.middleRows(StateErrors::kVelocity + 3 * k, 3); };
  if (integrated) velocity(0) = solution.first_velocity;
  for (Index k = 0; k + 1 < N; ++k) {
    const double dt = rows.pairs[k].dt();
    if (!integrated)
      velocity(k) = T_VB[k].R * of_rows.middleRows<3>(6 * k) / dt - 0.5 * dt * solution.gravity;
    if (integrated || k + 2 == N)
      velocity(k + 1) =
          velocity(k) + dt * solution.gravity - T_VB[k].R * of_rows.middleRows<3>(6 * k + 3);
  }
  errors->map = std::move(map);
  for (Index k = 1; k < N && solution.scale.size() > 0; ++k)
    errors->poses.middleRows<3>(6 * k - 3) += (rows.camera[k] - rows.camera[0]) * solution.scale;
}

void rescale(double factor, const std::vector<Vector3d>& camera, VisualFrameEstimate* estimate) {
  for (size_t k = 0; k < camera.size(); ++k)
    estimate->T_VB[k].t += (factor - 1.0) * (camera[k] - camera[0]);
  for (auto& [id, p_V] : estimate->landmarks) p_V += (factor - 1.0) * (p_V - camera[0]);
}

}  // namespace etalon
