#include "etalon/initialization/steps/linear_alignment.h"

#include <Eigen/Cholesky>
#include <cmath>

#include "etalon/core/so3.h"
#include "etalon/initialization/steps/gravity_sphere.h"
#include "etalon/optimization/bundle/normal_equations.h"

namespace etalon {

namespace {

using Eigen::Index;
using Eigen::Matrix3d;
using Eigen::MatrixXd;
using Eigen::Vector3d;
using Eigen::VectorXd;

Index offset(size_t k, Index size) { return size * k; }

/**
 * Rows of one pair in the unknowns x = (v_k, v_k+1, g): y - A x = (r_p, r_v), in the signs of the
 * preintegration's covariance, in which dp and dv are strongly correlated.
 */
void pairRows(const SE3& T_VBi, const SE3& T_VBj, const Preintegration::Deltas& d, double dt,
              Eigen::Matrix<double, 6, 9>* A, Eigen::Matrix<double, 6, 1>* y) {
  const Matrix3d R_BV = T_VBi.R.transpose();
  A->setZero();
  A->block<3, 3>(0, 0) = R_BV * dt;
  A->block<3, 3>(0, 6) = R_BV * (0.5 * dt * dt);
  A->block<3, 3>(3, 0) = R_BV;
  A->block<3, 3>(3, 3) = -R_BV;
  A->block<3, 3>(3, 6) = R_BV * dt;
  y->head<3>() = R_BV * (T_VBj.t - T_VBi.t) - d.dp;
  y->tail<3>() = -d.dv;
}

/**
 * Normal equations H x = b and the sum of squares of y, rows whitened pair by pair (`weighted`) or
 * left alone.
 */
struct AlignmentEquations {
  MatrixXd H;
  VectorXd b;
  double yy = 0.0;

  explicit AlignmentEquations(size_t keyframes)
      : H(MatrixXd::Zero(offset(keyframes, 3) + 3, offset(keyframes, 3) + 3)),
        b(VectorXd::Zero(offset(keyframes, 3) + 3)) {}

  void addPair(size_t k, const Eigen::Matrix<double, 6, 9>& A,
               const Eigen::Matrix<double, 6, 1>& y) {
    const Eigen::Matrix<double, 9, 9> AtA = A.transpose() * A;
    const Eigen::Matrix<double, 9, 1> Aty = A.transpose() * y;
    const Index v = offset(k, 3), g = H.rows() - 3;
    H.block<6, 6>(v, v) += AtA.topLeftCorner<6, 6>();
    H.block<6, 3>(v, g) += AtA.topRightCorner<6, 3>();
    H.block<3, 6>(g, v) += AtA.bottomLeftCorner<3, 6>();
    H.bottomRightCorner<3, 3>() += AtA.bottomRightCorner<3, 3>();
    b.segment<6>(v) += Aty.head<6>();
    b.tail<3>() += Aty.tail<3>();
    yy += y.squaredNorm();
  }
};

Eigen::Matrix<double, 6, 6> positionVelocityCovariance(const Preintegration& preintegration) {
  return preintegration.covariance().block<6, 6>(state_index::kPosition, state_index::kPosition);
}

/**
 * d(r_p, r_v)/d(poses) of all pairs, 6(N-1) x 6(N-1), columns [rotation, position] of keyframes
 * 1..; r is taken at zero, where R^T (p_j - p_i - ...) is dp and R^T (v_j - v_i - ...) is dv.
 */
MatrixXd poseJacobian(const std::vector<SE3>& T_VB,
                      const std::vector<Preintegration::Deltas>& deltas) {
  const Index n = offset(deltas.size(), 6);
  MatrixXd J = MatrixXd::Zero(n, n);
  for (size_t k = 0; k < deltas.size(); ++k) {
    const Matrix3d R_BV = T_VB[k].R.transpose();
    const Index row = offset(k, 6);
    J.block<3, 3>(row, row + 3) = R_BV;  // p_k+1
    if (k == 0) continue;                // the first keyframe is exact
    J.block<3, 3>(row, row - 6) = hat(deltas[k].dp);
    J.block<3, 3>(row + 3, row - 6) = hat(deltas[k].dv);
    J.block<3, 3>(row, row - 3) = -R_BV;
  }
  return J;
}

/** What the rows are whitened by: the covariance of the IMU, and of the poses if it is given. */
MatrixXd rowCovariance(const std::vector<Preintegration>& preintegrations,
                       const MatrixXd& rows_by_poses, const MatrixXd& pose_covariance) {
  const Index n = rows_by_poses.rows();
  MatrixXd noise = MatrixXd::Zero(n, n);
  if (pose_covariance.rows() == n)
    noise = rows_by_poses * pose_covariance * rows_by_poses.transpose();
  for (size_t k = 0; k < preintegrations.size(); ++k)
    noise.block<6, 6>(offset(k, 6), offset(k, 6)) += positionVelocityCovariance(preintegrations[k]);
  return noise;
}

/** Rows of all pairs whitened by the covariance of IMU and poses together. */
bool addJointly(LinearAlignmentRows rows, const std::vector<Preintegration>& preintegrations,
                const MatrixXd& pose_covariance, AlignmentEquations* equations) {
  const Eigen::LLT<MatrixXd> factor(rowCovariance(preintegrations, rows.by_poses, pose_covariance));
  if (factor.info() != Eigen::Success) return false;
  factor.matrixL().solveInPlace(rows.A);
  factor.matrixL().solveInPlace(rows.y);
  equations->H = rows.A.transpose() * rows.A;
  equations->b = rows.A.transpose() * rows.y;
  equations->yy = rows.y.squaredNorm();
  return true;
}

bool fill(const std::vector<SE3>& T_VB, const std::vector<Preintegration>& preintegrations,
          const ImuBias& bias, const LinearAlignmentOptions& options,
          AlignmentEquations* equations) {
  if (options.weighted && options.pose_covariance.rows() == offset(preintegrations.size(), 6))
    return addJointly(linearAlignmentRows(T_VB, preintegrations, bias), preintegrations,
                      options.pose_covariance, equations);
  for (size_t k = 0; k < preintegrations.size(); ++k) {
    const Preintegration& p = preintegrations[k];
    Eigen::Matrix<double, 6, 9> A;
    Eigen::Matrix<double, 6, 1> y;
    pairRows(T_VB[k], T_VB[k + 1], p.corrected(bias), p.dt(), &A, &y);
    if (options.weighted) {
      const Eigen::LLT<Eigen::Matrix<double, 6, 6>> noise(positionVelocityCovariance(p));
      if (noise.info() != Eigen::Success) return false;
      A = noise.matrixL().solve(A).eval();
      y = noise.matrixL().solve(y).eval();
    }
    equations->addPair(k, A, y);
  }
  return true;
}

LinearAlignmentResult alignmentNotDetermined() {
  LinearAlignmentResult result;
  result.summary.stop(Termination::kSingular, "velocities and gravity are not determined");
  return result;
}

LinearAlignmentResult unpack(const NormConstrainedSolution& solution,
                             const AlignmentEquations& equations) {
  LinearAlignmentResult result;
  result.summary = solution.summary;
  result.summary.initial_cost += 0.5 * equations.yy;
  result.summary.final_cost += 0.5 * equations.yy;
  if (!solution.summary.usable()) return result;
  for (Index k = 0; k + 3 < solution.x.size(); k += 3)
    result.v_VB.emplace_back(solution.x.segment<3>(k));
  result.g_V = solution.x.tail<3>();
  return result;
}

}  // namespace

Expected<void> checkFreeGravity(double free_mps2, double gravity_mps2, double max_deviation_mps2) {
  const double deviation = free_mps2 - gravity_mps2;
  if (std::abs(deviation) <= max_deviation_mps2) return {};
  return refuse(RefusalStatus::kImplausible, "gravity comes out ", deviation > 0.0 ? "+" : "",
                Value(deviation, 2), " m/s^2 away from its magnitude, at most ",
                Bound(max_deviation_mps2, 2), " is wanted");
}

LinearAlignmentRows linearAlignmentRows(const std::vector<SE3>& T_VB,
                                        const std::vector<Preintegration>& preintegrations,
                                        const ImuBias& bias) {
  std::vector<Preintegration::Deltas> deltas;
  for (const Preintegration& p : preintegrations) deltas.push_back(p.corrected(bias));
  const Index n = offset(deltas.size(), 6);
  LinearAlignmentRows rows{MatrixXd::Zero(n, offset(T_VB.size(), 3) + 3), VectorXd(n),
                           poseJacobian(T_VB, deltas), MatrixXd(n, 6)};
  for (size_t k = 0; k < deltas.size(); ++k) {
    const Preintegration& p = preintegrations[k];
    Eigen::Matrix<double, 6, 9> A;
    Eigen::Matrix<double, 6, 1> y;
    pairRows(T_VB[k], T_VB[k + 1], deltas[k], p.dt(), &A, &y);
    const Index row = offset(k, 6);
    rows.A.block<6, 6>(row, offset(k, 3)) = A.leftCols<6>();
    rows.A.block<6, 3>(row, rows.A.cols() - 3) = A.rightCols<3>();
    rows.y.segment<6>(row) = y;
    rows.by_bias.middleRows<6>(row) << p.dp_dbg(), p.dp_dba(), p.dv_dbg(), p.dv_dba();
  }
  return rows;
}

LinearAlignmentResult alignLinearly(const std::vector<SE3>& T_VB,
                                    const std::vector<Preintegration>& preintegrations,
                                    const ImuBias& bias, const LinearAlignmentOptions& options) {
  if (T_VB.size() < 3) return alignmentNotDetermined();  // six rows for nine unknowns
  AlignmentEquations equations(T_VB.size());
  if (!fill(T_VB, preintegrations, bias, options, &equations)) return alignmentNotDetermined();
  const ScaledCholesky factor(equations.H);
  if (!factor.determined()) return alignmentNotDetermined();
  const Vector3d free = factor.solve(equations.b).tail<3>();
  if (!(free.norm() > 0.0) || !free.allFinite()) return alignmentNotDetermined();
  LinearAlignmentResult result =
      unpack(options.tangent_iterations > 0
                 ? refineOnTangentPlane(equations.H, equations.b, options.gravity_mps2, free,
                                        options.tangent_iterations)
                 : solveNormConstrained(equations.H, equations.b, options.gravity_mps2),
             equations);
  result.free_gravity_mps2 = free.norm();
  return result;
}

LinearAlignmentResult alignVelocitiesAndGravity(const std::vector<SE3>& T_VB,
                                                const std::vector<Preintegration>& preintegrations,
                                                const ImuBias& bias, double gravity_mps2,
                                                const Vector3d& g_seed) {
  AlignmentEquations equations(T_VB.size());
  if (!fill(T_VB, preintegrations, bias, {}, &equations)) return alignmentNotDetermined();
  return unpack(refineOnTangentPlane(equations.H, equations.b, gravity_mps2, g_seed), equations);
}

LinearAlignmentResponse linearAlignmentResponse(const std::vector<SE3>& T_VB,
                                                const std::vector<Preintegration>& preintegrations,
                                                const ImuBias& bias,
                                                const LinearAlignmentOptions& options,
                                                const Vector3d& g_V) {
  LinearAlignmentResponse response;
  response.rows = linearAlignmentRows(T_VB, preintegrations, bias);
  const MatrixXd basis = tangentUnknowns(offset(T_VB.size(), 3), g_V);
  const MatrixXd A = response.rows.A * basis;
  MatrixXd AtW = A.transpose();
  if (options.weighted) {
    const Eigen::LLT<MatrixXd> noise(
        rowCovariance(preintegrations, response.rows.by_poses, options.pose_covariance));
    if (noise.info() != Eigen::Success) return {};
    AtW = noise.solve(A).transpose();
  }
  const ScaledCholesky factor(AtW * A);
  if (!factor.determined()) return {};
  response.by_rows = basis * factor.solve(AtW);
  return response;
}

}  // namespace etalon
