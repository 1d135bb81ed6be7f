#include "likelihood.h"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "smooth_error.h"

namespace etalon::ground_truth {
namespace {

namespace ix = state_index;
using Eigen::Matrix3d;
using Eigen::Vector3d;

// Priors so wide that they only keep the equations positive definite.
constexpr double kVelocitySigma = 30.0;    // m/s
constexpr double kGyroBiasSigma = 0.5;     // rad/s
constexpr double kAccelBiasSigma = 2.0;    // m/s^2
constexpr double kShiftSigma = 0.05;       // s
constexpr double kTurnSigma = 1.0;         // rad
constexpr double kLeverSigma = 0.2;        // m
constexpr double kDirectionSigma = 100.0;  // of gravity across its direction, m/s^2
/** Gravity is between 9.78 and 9.83 m/s^2 on the ground; a device's own scale error is of the same
 * size. */
constexpr double kGravityNorm = 9.806, kGravitySigma = 0.02;

Eigen::Matrix<double, 9, 1> startSigmas() {
  Eigen::Matrix<double, 9, 1> sigmas;
  sigmas << Vector3d::Constant(kVelocitySigma), Vector3d::Constant(kGyroBiasSigma),
      Vector3d::Constant(kAccelBiasSigma);
  return sigmas;
}

Eigen::Matrix<double, 9, 1> startValues(const Node& node) {
  Eigen::Matrix<double, 9, 1> values;
  values << node.body.v_WB, node.body.bias.gyro, node.body.bias.accel;
  return values;
}

}  // namespace

size_t Likelihood::believedRows() const {
  return static_cast<size_t>(std::count_if(linear_.nodes.begin(), linear_.nodes.end(),
                                           [](const Node& node) { return node.counts; }));
}

Likelihood::Decay Likelihood::decay(int kind, double dt) const {
  const Transition t = transition(dt / sizeOf(kKinds[kind].time));
  const double sigma = sizeOf(kKinds[kind].correlated);
  Decay decay;
  decay.F = t.F;
  decay.covariance = sigma * sigma * t.covariance;
  decay.information = decay.covariance.inverse();
  return decay;
}

Eigen::Matrix<double, 3, 2> Likelihood::errorAfter(size_t k, int kind) const {
  return errorOf(linear_.nodes[k], kind) +
         solver_.nodes()[k].segment<6>(kKinds[kind].offset).reshaped(3, 2);
}

void Likelihood::addRow(size_t k, ChainEquations* equations) const {
  const RowTerm& row = rows_[k];
  const auto add = [&](const Eigen::Matrix<double, 3, kNodeSize>& J,
                       const Eigen::Matrix<double, 3, kBorderSize>& G, const Vector3d& residual,
                       double sigma) {
    const double weight = 1.0 / (sigma * sigma);
    const Eigen::Matrix<double, kNodeSize, 3> Jt = weight * J.transpose();
    equations->diagonal[k].noalias() += Jt * J;
    equations->border[k].noalias() += Jt * G;
    equations->rhs[k].noalias() -= Jt * residual;
    equations->border_diagonal.noalias() += weight * G.transpose() * G;
    equations->border_rhs.noalias() -= weight * G.transpose() * residual;
  };
  add(row.J_position, row.G_position, row.position, sizeOf(kPositionWhite));
  add(row.J_rotation, row.G_rotation, row.rotation, sizeOf(kRotationWhite));
}

void Likelihood::addMotion(size_t k, ChainEquations* equations) {
  const MotionTerm& motion = linear_.motions[k];
  if (!motion.known) return;
  Eigen::Matrix<double, 15, 15> covariance = Eigen::Matrix<double, 15, 15>::Zero();
  for (int source = 0; source < kImuSources; ++source)
    covariance += sizeOf(source) * sizeOf(source) * motion.covariance[source];
  WhiteMotion& white = white_[k];
  const Eigen::LLT<Eigen::Matrix<double, 15, 15>> cholesky(covariance);
  white.L = cholesky.matrixL();
  white.rows << motion.J_this, motion.J_next, motion.J_gravity, motion.residual;
  cholesky.matrixL().solveInPlace(white.rows);
  const Eigen::Matrix<double, 34, 34> H = white.rows.transpose() * white.rows;
  equations->diagonal[k].topLeftCorner<15, 15>() += H.block<15, 15>(0, 0);
  equations->diagonal[k + 1].topLeftCorner<15, 15>() += H.block<15, 15>(15, 15);
  equations->next[k].topLeftCorner<15, 15>() += H.block<15, 15>(0, 15);
  equations->border[k].block<15, 3>(0, kGravity) += H.block<15, 3>(0, 30);
  equations->border[k + 1].block<15, 3>(0, kGravity) += H.block<15, 3>(15, 30);
  equations->border_diagonal.block<3, 3>(kGravity, kGravity) += H.block<3, 3>(30, 30);
  equations->rhs[k].head<15>() -= H.block<15, 1>(0, 33);
  equations->rhs[k + 1].head<15>() -= H.block<15, 1>(15, 33);
  equations->border_rhs.segment<3>(kGravity) -= H.block<3, 1>(30, 33);
}

void Likelihood::addDecay(size_t k, ChainEquations* equations) const {
  for (int kind = 0; kind < 2; ++kind) {
    const int at = kKinds[kind].offset;
    const Decay d = decay(kind, linear_.motions[k].dt);
    const ErrorAndRate residual =
        errorOf(linear_.nodes[k + 1], kind) - errorOf(linear_.nodes[k], kind) * d.F.transpose();
    const Eigen::Matrix2d WF = d.information * d.F, FWF = d.F.transpose() * WF;
    for (int i = 0; i < 2; ++i) {
      for (int j = 0; j < 2; ++j) {
        equations->diagonal[k].block<3, 3>(at + 3 * i, at + 3 * j).diagonal().array() += FWF(i, j);
        equations->diagonal[k + 1].block<3, 3>(at + 3 * i, at + 3 * j).diagonal().array() +=
            d.information(i, j);
        equations->next[k].block<3, 3>(at + 3 * i, at + 3 * j).diagonal().array() -= WF(j, i);
      }
    }
    equations->rhs[k].segment<6>(at) += (residual * WF).reshaped();
    equations->rhs[k + 1].segment<6>(at) -= (residual * d.information).reshaped();
  }
}

void Likelihood::addStart(size_t k, ChainEquations* equations) const {
  const Eigen::Matrix<double, 9, 1> weights = startSigmas().array().square().inverse();
  equations->diagonal[k].diagonal().segment<9>(ix::kVelocity) += weights;
  equations->rhs[k].segment<9>(ix::kVelocity) -=
      weights.cwiseProduct(startValues(linear_.nodes[k]));
  if (k > 0) return;
  for (int kind = 0; kind < 2; ++kind) {
    const double weight = std::pow(sizeOf(kKinds[kind].correlated), -2.0);
    const int at = kKinds[kind].offset;
    equations->diagonal[0].diagonal().segment<6>(at).array() += weight;
    equations->rhs[0].segment<6>(at) -= weight * errorOf(linear_.nodes[0], kind).reshaped();
  }
}

void Likelihood::addShared(ChainEquations* equations) const {
  const Shared& shared = linear_.shared;
  BorderVector weights;
  weights << Eigen::Vector2d::Constant(1.0 / (kShiftSigma * kShiftSigma)),
      Vector3d::Constant(1.0 / (kTurnSigma * kTurnSigma)),
      Vector3d::Constant(1.0 / (kLeverSigma * kLeverSigma)),
      Vector3d::Constant(1.0 / (kDirectionSigma * kDirectionSigma));
  equations->border_diagonal.diagonal() += weights;
  const Vector3d down = shared.g_G.normalized();
  const double weight = 1.0 / (kGravitySigma * kGravitySigma);
  equations->border_diagonal.block<3, 3>(kGravity, kGravity) += weight * down * down.transpose();
  equations->border_rhs.segment<3>(kGravity) -= weight * (shared.g_G.norm() - kGravityNorm) * down;
}

bool Likelihood::solve(const SizeVector& log_sizes, Posterior* posterior,
                       std::pair<size_t, size_t> left_out) {
  log_sizes_ = log_sizes;
  left_out_ = left_out;
  rows_ = linear_.rows(sizeOf(kPositionBandwidth), sizeOf(kRotationBandwidth));
  white_.resize(linear_.motions.size());
  ChainEquations equations(linear_.nodes.size());
  for (size_t k = 0; k < linear_.nodes.size(); ++k) {
    if (counts(k)) addRow(k, &equations);
    if (starts(k)) addStart(k, &equations);
    if (k == linear_.motions.size()) break;
    addMotion(k, &equations);
    addDecay(k, &equations);
  }
  addShared(&equations);
  if (!solver_.factorize(std::move(equations))) return false;
  posterior->nodes = solver_.nodes();
  posterior->border = solver_.border();
  posterior->border_covariance = solver_.borderCovariance();
  posterior->objective = halfSquares() + logNormalisation() + 0.5 * solver_.logDeterminant();
  for (int i = 0; i < kErrorSizes; ++i) {
    if (priors_[i].log_sigma == 0.0) continue;
    const double from_prior = log_sizes[i] - std::log(priors_[i].value);
    posterior->objective +=
        0.5 * from_prior * from_prior / (priors_[i].log_sigma * priors_[i].log_sigma);
  }
  return std::isfinite(posterior->objective);
}

double Likelihood::motionHalfSquares(size_t k) const {
  Eigen::Matrix<double, 34, 1> x;
  x << solver_.nodes()[k].head<15>(), solver_.nodes()[k + 1].head<15>(),
      solver_.border().segment<3>(kGravity), 1.0;
  return 0.5 * (white_[k].rows * x).squaredNorm();
}

double Likelihood::rowHalfSquares(size_t k) const {
  const RowTerm& row = rows_[k];
  const NodeVector& x = solver_.nodes()[k];
  const BorderVector& g = solver_.border();
  return 0.5 * ((row.position + row.J_position * x + row.G_position * g).squaredNorm() /
                    (sizeOf(kPositionWhite) * sizeOf(kPositionWhite)) +
                (row.rotation + row.J_rotation * x + row.G_rotation * g).squaredNorm() /
                    (sizeOf(kRotationWhite) * sizeOf(kRotationWhite)));
}

double Likelihood::decayHalfSquares(size_t k) const {
  double sum = 0.0;
  for (int kind = 0; kind < 2; ++kind) {
    const Decay d = decay(kind, linear_.motions[k].dt);
    const ErrorAndRate residual = errorAfter(k + 1, kind) - errorAfter(k, kind) * d.F.transpose();
    sum += 0.5 * (residual.transpose() * residual).cwiseProduct(d.information).sum();
  }
  return sum;
}

double Likelihood::startHalfSquares(size_t k) const {
  const Eigen::Matrix<double, 9, 1> values =
      startValues(linear_.nodes[k]) + solver_.nodes()[k].segment<9>(ix::kVelocity);
  double sum = 0.5 * values.cwiseQuotient(startSigmas()).squaredNorm();
  for (int kind = 0; k == 0 && kind < 2; ++kind)
    sum += 0.5 * (errorAfter(0, kind) / sizeOf(kKinds[kind].correlated)).squaredNorm();
  return sum;
}

double Likelihood::sharedHalfSquares() const {
  // The wide priors of the others hardly depend on the sizes.
  const Vector3d g = linear_.shared.g_G + solver_.border().segment<3>(kGravity);
  const double off = linear_.shared.g_G.normalized().dot(g) - kGravityNorm;
  return 0.5 * off * off / (kGravitySigma * kGravitySigma) +
         0.5 * (solver_.border().head<2>() / kShiftSigma).squaredNorm() +
         0.5 * (solver_.border().segment<3>(kTurn) / kTurnSigma).squaredNorm() +
         0.5 * (solver_.border().segment<3>(kLever) / kLeverSigma).squaredNorm() +
         0.5 * (solver_.border().segment<3>(kGravity) / kDirectionSigma).squaredNorm();
}

double Likelihood::halfSquares() const {
  double sum = sharedHalfSquares();
  for (size_t k = 0; k < linear_.nodes.size(); ++k) {
    if (counts(k)) sum += rowHalfSquares(k);
    if (starts(k)) sum += startHalfSquares(k);
    if (k == linear_.motions.size()) break;
    if (linear_.motions[k].known) sum += motionHalfSquares(k);
    sum += decayHalfSquares(k);
  }
  return sum;
}

double Likelihood::logNormalisation() const {
  double sum = 6.0 * (log_sizes_[kPositionCorrelated] + log_sizes_[kRotationCorrelated]);
  const size_t n = linear_.nodes.size();
  for (size_t k = 0; k < n; ++k)
    if (counts(k)) sum += 3.0 * (log_sizes_[kPositionWhite] + log_sizes_[kRotationWhite]);
  for (size_t k = 0; k + 1 < n; ++k) {
    if (linear_.motions[k].known) sum += white_[k].L.diagonal().array().log().sum();
    for (int kind = 0; kind < 2; ++kind)
      sum += 1.5 * std::log(decay(kind, linear_.motions[k].dt).covariance.determinant());
  }
  return sum;
}

}  // namespace etalon::ground_truth
