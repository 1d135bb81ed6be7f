#include "etalon/initialization/steps/inertial_only_map.h"

#include <Eigen/Cholesky>
#include <cmath>

#include "etalon/core/so3.h"
#include "etalon/core/symmetric.h"
#include "etalon/initialization/steps/gravity_sphere.h"
#include "etalon/optimization/bundle/normal_equations.h"
#include "etalon/optimization/residuals/preintegration_residual.h"

namespace etalon {

namespace {

/** State and normal equations. Order of the unknowns: b_g, b_a, gravity direction (2), v_0 ..
 * v_N-1. */
class InertialOnlyProblem {
 public:
  static constexpr int kBias = 0, kGravity = 6, kVelocity = 8;

  struct State {
    ImuBias bias;
    Eigen::Vector3d g_V;
    std::vector<Eigen::Vector3d> v_VB;
  };

  InertialOnlyProblem(const std::vector<SE3>& T_VB,
                      const std::vector<Preintegration>& preintegrations,
                      const InertialOnlyOptions& options)
      : T_VB_(T_VB), preintegrations_(preintegrations), options_(options) {
    for (const Preintegration& p : preintegrations) sqrt_information_.push_back(sqrtInformation(p));
  }

  int size() const { return kVelocity + 3 * static_cast<int>(T_VB_.size()); }

  State seed() const {
    State s;
    s.bias = options_.prior_mean;
    if (options_.gyro_bias) s.bias.gyro = options_.gyro_bias->gyro;
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    for (size_t k = 0; k < preintegrations_.size(); ++k)
      sum -= T_VB_[k].R * preintegrations_[k].corrected(s.bias).dv;
    s.g_V = options_.gravity_mps2 * sum.normalized();
    for (size_t k = 0; k < T_VB_.size(); ++k) {
      const size_t i = k + 1 < T_VB_.size() ? k : k - 1;
      s.v_VB.push_back((T_VB_[i + 1].t - T_VB_[i].t) / preintegrations_[i].dt());
    }
    return s;
  }

  State moved(const State& s, const Eigen::VectorXd& step) const {
    State m = s;
    m.bias.gyro += step.segment<3>(kBias);
    m.bias.accel += step.segment<3>(kBias + 3);
    m.g_V = (s.g_V + options_.gravity_mps2 * tangentBasis(s.g_V) * step.segment<2>(kGravity))
                .normalized() *
            options_.gravity_mps2;
    for (size_t k = 0; k < s.v_VB.size(); ++k) m.v_VB[k] += step.segment<3>(kVelocity + 3 * k);
    return m;
  }

  /** Cost (half the sum of squares); H and b, if given, receive the normal equations H step = -b.
   */
  double evaluate(const State& s, Eigen::MatrixXd* H, Eigen::VectorXd* b) const {
    if (H) {
      H->setZero(size(), size());
      b->setZero(size());
    }
    double cost = 0.0;
    for (size_t k = 0; k < preintegrations_.size(); ++k) cost += addPair(s, k, H, b);
    const Eigen::Vector3d d_gyro = s.bias.gyro - options_.prior_mean.gyro;
    const Eigen::Vector3d d_accel = s.bias.accel - options_.prior_mean.accel;
    cost += 0.5 * (options_.prior_gyro_information * d_gyro.squaredNorm() +
                   options_.prior_accel_information * d_accel.squaredNorm());
    if (H) {
      H->diagonal().segment<3>(kBias).array() += options_.prior_gyro_information;
      H->diagonal().segment<3>(kBias + 3).array() += options_.prior_accel_information;
      b->segment<3>(kBias) += options_.prior_gyro_information * d_gyro;
      b->segment<3>(kBias + 3) += options_.prior_accel_information * d_accel;
    }
    if (options_.gyro_bias) {
      const Eigen::Matrix3d& information = options_.gyro_bias->information;
      const Eigen::Vector3d d = s.bias.gyro - options_.gyro_bias->gyro;
      cost += 0.5 * d.dot(information * d);
      if (H) {
        H->block<3, 3>(kBias, kBias) += information;
        b->segment<3>(kBias) += information * d;
      }
    }
    return cost;
  }

  InertialOnlyResponse response(const State& s) const {
    using Eigen::Index;
    const Index n = preintegrations_.size();
    InertialOnlyResponse out;
    out.residuals_by_poses = Eigen::MatrixXd::Zero(9 * n, 6 * n);
    Eigen::MatrixXd AtW = Eigen::MatrixXd::Zero(size(), 9 * n);
    for (Index k = 0; k < n; ++k) {
      const size_t i = k;
      PreintegrationJacobians J;
      preintegrationResidual(preintegrations_[i], T_VB_[i], s.v_VB[i], T_VB_[i + 1], s.v_VB[i + 1],
                             s.bias, s.g_V, &J);
      const Eigen::Matrix<double, 9, 9>& L = sqrt_information_[i];
      const Eigen::Matrix<double, 14, 9> weighted = columns(s, J).transpose() * L.transpose() * L;
      AtW.block<8, 9>(0, 9 * k) = weighted.topRows<8>();
      AtW.block<6, 9>(kVelocity + 3 * k, 9 * k) = weighted.bottomRows<6>();
      out.residuals_by_poses.block<9, 6>(9 * k, 6 * k) = J.pose_j;
      if (k > 0) out.residuals_by_poses.block<9, 6>(9 * k, 6 * (k - 1)) = J.pose_i;
    }
    Eigen::MatrixXd prior = Eigen::MatrixXd::Zero(size(), 6), gyro = prior.leftCols(3);
    prior.diagonal() << Eigen::Vector3d::Constant(options_.prior_gyro_information),
        Eigen::Vector3d::Constant(options_.prior_accel_information);
    if (options_.gyro_bias) gyro.topRows<3>() = options_.gyro_bias->information;
    Eigen::MatrixXd H;
    Eigen::VectorXd b;
    evaluate(s, &H, &b);
    const ScaledCholesky factor(H);
    if (!factor.determined()) return {};
    out.by_residuals = -factor.solve(AtW);
    out.by_prior_mean = factor.solve(prior);
    out.by_gyro_bias = factor.solve(gyro);
    return out;
  }

 private:
  /** Columns: [b_g, b_a, gravity (2)] and [v_k, v_k+1], neighbours in the state. */
  Eigen::Matrix<double, 9, 14> columns(const State& s, const PreintegrationJacobians& J) const {
    Eigen::Matrix<double, 9, 14> A;
    A.leftCols<3>() = J.bias_gyro;
    A.middleCols<3>(3) = J.bias_accel;
    A.middleCols<2>(6) = options_.gravity_mps2 * J.gravity * tangentBasis(s.g_V);
    A.middleCols<3>(8) = J.velocity_i;
    A.rightCols<3>() = J.velocity_j;
    return A;
  }

  double addPair(const State& s, size_t k, Eigen::MatrixXd* H, Eigen::VectorXd* b) const {
    PreintegrationJacobians J;
    Eigen::Matrix<double, 9, 1> r =
        preintegrationResidual(preintegrations_[k], T_VB_[k], s.v_VB[k], T_VB_[k + 1],
                               s.v_VB[k + 1], s.bias, s.g_V, H ? &J : nullptr);
    const Eigen::Matrix<double, 9, 9>& L = sqrt_information_[k];
    r = L * r;
    if (H) {
      const Eigen::Matrix<double, 9, 14> A = L * columns(s, J);
      const Eigen::Matrix<double, 14, 14> AtA = A.transpose() * A;
      const Eigen::Matrix<double, 14, 1> Atr = A.transpose() * r;
      const Eigen::Index v = kVelocity + 3 * k;
      H->block<8, 8>(0, 0) += AtA.topLeftCorner<8, 8>();
      H->block<8, 6>(0, v) += AtA.topRightCorner<8, 6>();
      H->block<6, 8>(v, 0) += AtA.bottomLeftCorner<6, 8>();
      H->block<6, 6>(v, v) += AtA.bottomRightCorner<6, 6>();
      b->head<8>() += Atr.head<8>();
      b->segment<6>(v) += Atr.tail<6>();
    }
    return 0.5 * r.squaredNorm();
  }

  const std::vector<SE3>& T_VB_;
  const std::vector<Preintegration>& preintegrations_;
  const InertialOnlyOptions& options_;
  std::vector<Eigen::Matrix<double, 9, 9>> sqrt_information_;
};

/** Covariance of biases and gravity direction, and the weakest direction's information of the
 * latter. */
void fillCovariance(const Eigen::MatrixXd& H, InertialOnlyResult* result) {
  const ScaledCholesky factor(H);
  if (!factor.determined()) return;
  const Eigen::MatrixXd covariance =
      factor.solve(Eigen::MatrixXd::Identity(H.rows(), 8)).topRows(8);
  if (!covariance.allFinite()) return;
  result->covariance = 0.5 * (covariance + covariance.transpose());
  const Eigen::Matrix2d gravity =
      result->covariance.block<2, 2>(InertialOnlyProblem::kGravity, InertialOnlyProblem::kGravity);
  const double largest = symmetricEigenvalues(gravity)(1);
  if (largest > 0) result->smallest_eigenvalue_gravity = 1.0 / largest;
}

}  // namespace

InertialOnlyResponse inertialOnlyResponse(const std::vector<SE3>& T_VB,
                                          const std::vector<Preintegration>& preintegrations,
                                          const InertialOnlyOptions& options,
                                          const InertialOnlyResult& result) {
  return InertialOnlyProblem(T_VB, preintegrations, options)
      .response({result.bias, result.g_V, result.v_VB});
}

InertialOnlyResult solveInertialOnlyMap(const std::vector<SE3>& T_VB,
                                        const std::vector<Preintegration>& preintegrations,
                                        const InertialOnlyOptions& options) {
  const InertialOnlyProblem problem(T_VB, preintegrations, options);
  InertialOnlyProblem::State state = problem.seed();
  Eigen::MatrixXd H;
  Eigen::VectorXd b;
  InertialOnlyResult result;
  SolverSummary& summary = result.summary;
  double cost = summary.initial_cost = problem.evaluate(state, &H, &b);
  double lambda = 1e-6;
  summary.termination = Termination::kMaxIterations;
  if (!std::isfinite(cost)) summary.stop(Termination::kFailed, "the cost is not finite");
  while (summary.usable() && summary.iterations < options.max_iterations) {
    ++summary.iterations;
    Eigen::MatrixXd damped = H;
    damped.diagonal() *= 1.0 + lambda;
    const Eigen::VectorXd step = damped.ldlt().solve(-b);
    if (!step.allFinite()) {
      summary.stop(Termination::kSingular, "the poses do not determine the state");
      break;
    }
    const InertialOnlyProblem::State candidate = problem.moved(state, step);
    const double candidate_cost = problem.evaluate(candidate, nullptr, nullptr);
    // At the minimum the cost stops falling by more than rounding: converged whether the step is
    // taken or not.
    const double decrease = cost - candidate_cost;
    if (std::abs(decrease) <= 1e-11 * cost + 1e-16 || step.norm() < 1e-12) {
      summary.termination = Termination::kConverged;
      if (decrease > 0) state = candidate;
      break;
    }
    if (decrease > 0) {
      state = candidate;
      cost = problem.evaluate(state, &H, &b);
      lambda = std::max(lambda * 0.1, 1e-12);
    } else {
      lambda *= 10.0;
      if (lambda <= 1e8) continue;
      summary.stop(Termination::kFailed, "no step lowers the cost");
      break;
    }
  }
  summary.final_cost = problem.evaluate(state, &H, &b);
  result.g_V = state.g_V;
  result.v_VB = state.v_VB;
  result.bias = state.bias;
  fillCovariance(H, &result);
  return result;
}

}  // namespace etalon
