#include <cmath>
#include <vector>

#include "likelihood.h"
#include "smooth_error.h"

namespace etalon::ground_truth {

using Eigen::Matrix3d;
using Eigen::Vector3d;

void Likelihood::rowSlope(size_t k, const ChainCovariance& P, SizeVector* slope) const {
  const RowTerm& row = rows_[k];
  const auto add = [&](const Eigen::Matrix<double, 3, kNodeSize>& J,
                       const Eigen::Matrix<double, 3, kBorderSize>& G, const Vector3d& before,
                       int white) {
    const Vector3d residual = before + J * solver_.nodes()[k] + G * solver_.border();
    const Matrix3d cross = J * P.border[k] * G.transpose();
    const double squares = residual.squaredNorm() + (J * P.diagonal[k] * J.transpose()).trace() +
                           (G * P.border_diagonal * G.transpose()).trace() + 2.0 * cross.trace();
    (*slope)[white] += 3.0 - squares / (sizeOf(white) * sizeOf(white));
  };
  add(row.J_position, row.G_position, row.position, kPositionWhite);
  add(row.J_rotation, row.G_rotation, row.rotation, kRotationWhite);
}

void Likelihood::motionSlope(size_t k, const ChainCovariance& P, SizeVector* slope) const {
  Eigen::Matrix<double, 33, 33> C;
  C.block<15, 15>(0, 0) = P.diagonal[k].topLeftCorner<15, 15>();
  C.block<15, 15>(15, 15) = P.diagonal[k + 1].topLeftCorner<15, 15>();
  C.block<15, 15>(0, 15) = P.next[k].topLeftCorner<15, 15>();
  C.block<15, 3>(0, 30) = P.border[k].block<15, 3>(0, kGravity);
  C.block<15, 3>(15, 30) = P.border[k + 1].block<15, 3>(0, kGravity);
  C.block<3, 3>(30, 30) = P.border_diagonal.block<3, 3>(kGravity, kGravity);
  C.triangularView<Eigen::StrictlyLower>() = C.transpose();
  Eigen::Matrix<double, 33, 1> x;
  x << solver_.nodes()[k].head<15>(), solver_.nodes()[k + 1].head<15>(),
      solver_.border().segment<3>(kGravity);
  const auto J = white_[k].rows.leftCols<33>();
  const Eigen::Matrix<double, 15, 1> residual = white_[k].rows.col(33) + J * x;
  const Eigen::Matrix<double, 15, 33> JC = J * C;
  Eigen::Matrix<double, 15, 15> excess = Eigen::Matrix<double, 15, 15>::Identity() -
                                         residual * residual.transpose() - JC * J.transpose();
  // W - W S W, W the inverse of the covariance and S the second moment of the residual.
  const auto L = white_[k].L.triangularView<Eigen::Lower>();
  L.transpose().solveInPlace(excess);
  excess.transposeInPlace();
  L.transpose().solveInPlace(excess);
  for (int source = 0; source < kImuSources; ++source)
    (*slope)[source] += sizeOf(source) * sizeOf(source) *
                        excess.cwiseProduct(linear_.motions[k].covariance[source]).sum();
}

void Likelihood::decaySlope(size_t k, const ChainCovariance& P, SizeVector* slope) const {
  constexpr double kStep = 1e-4;  // of the logarithm of the time
  for (int kind = 0; kind < 2; ++kind) {
    const int at = kKinds[kind].offset;
    const double dt = linear_.motions[k].dt, sigma = sizeOf(kKinds[kind].correlated);
    const Decay d = decay(kind, dt);
    const ErrorAndRate e0 = errorAfter(k, kind), e1 = errorAfter(k + 1, kind);
    Eigen::Matrix2d s00 = e0.transpose() * e0, s01 = e0.transpose() * e1, s11 = e1.transpose() * e1;
    for (int i = 0; i < 2; ++i) {
      for (int j = 0; j < 2; ++j) {
        s00(i, j) += P.diagonal[k].block<3, 3>(at + 3 * i, at + 3 * j).trace();
        s01(i, j) += P.next[k].block<3, 3>(at + 3 * i, at + 3 * j).trace();
        s11(i, j) += P.diagonal[k + 1].block<3, 3>(at + 3 * i, at + 3 * j).trace();
      }
    }
    const auto squares = [&](const Eigen::Matrix2d& F) -> Eigen::Matrix2d {
      return s11 - F * s01 - (F * s01).transpose() + F * s00 * F.transpose();
    };
    const Eigen::Matrix2d WD = d.information * squares(d.F);
    (*slope)[kKinds[kind].correlated] += 6.0 - WD.trace();
    const Transition up = transition(dt / (sizeOf(kKinds[kind].time) * std::exp(kStep)));
    const Transition down = transition(dt / (sizeOf(kKinds[kind].time) * std::exp(-kStep)));
    const Eigen::Matrix2d dQ = sigma * sigma * (up.covariance - down.covariance) / (2.0 * kStep);
    const Eigen::Matrix2d dD = (squares(up.F) - squares(down.F)) / (2.0 * kStep);
    const Eigen::Matrix2d WdQ = d.information * dQ;
    (*slope)[kKinds[kind].time] +=
        0.5 * (3.0 * WdQ.trace() - (WdQ * WD).trace() + (d.information * dD).trace());
  }
}

void Likelihood::bandwidthSlope(const ChainCovariance& P, const std::vector<size_t>& block_begins,
                                Slope* slope) const {
  constexpr double kStep = 1e-4;  // of the logarithm
  const auto moved = linear_.rows(sizeOf(kPositionBandwidth) * std::exp(kStep),
                                  sizeOf(kRotationBandwidth) * std::exp(kStep));
  size_t block = 0;
  for (size_t k = 0; k < rows_.size(); ++k) {
    while (block + 1 < block_begins.size() && block_begins[block + 1] <= k) ++block;
    if (!counts(k)) continue;
    const auto add = [&](const Eigen::Matrix<double, 3, kNodeSize>& J,
                         const Eigen::Matrix<double, 3, kBorderSize>& G,
                         const Eigen::Matrix<double, 3, kBorderSize>& G_moved,
                         const Vector3d& before, const Vector3d& moved_before, int white,
                         int bandwidth) {
      const Vector3d residual = before + J * solver_.nodes()[k] + G * solver_.border();
      const Eigen::Matrix<double, 3, kBorderSize> dG = (G_moved - G) / kStep;
      const Vector3d d_residual = (moved_before - before) / kStep + dG * solver_.border();
      const Eigen::Matrix<double, kBorderSize, 3> cross =
          P.border[k].transpose() * J.transpose() + P.border_diagonal * G.transpose();
      const double part =
          (residual.dot(d_residual) + (dG * cross).trace()) / (sizeOf(white) * sizeOf(white));
      slope->total[bandwidth] += part;
      if (!block_begins.empty()) slope->of_blocks[block][bandwidth] += part;
    };
    add(rows_[k].J_position, rows_[k].G_position, moved[k].G_position, rows_[k].position,
        moved[k].position, kPositionWhite, kPositionBandwidth);
    add(rows_[k].J_rotation, rows_[k].G_rotation, moved[k].G_rotation, rows_[k].rotation,
        moved[k].rotation, kRotationWhite, kRotationBandwidth);
  }
}

Slope Likelihood::slope(const std::vector<size_t>& block_begins) const {
  const ChainCovariance P = solver_.covariance();
  Slope result;
  result.of_blocks.assign(block_begins.size(), SizeVector::Zero());
  size_t block = 0;
  for (size_t k = 0; k < linear_.nodes.size(); ++k) {
    SizeVector slope = SizeVector::Zero();
    if (counts(k)) rowSlope(k, P, &slope);
    if (k == 0)
      for (int kind = 0; kind < 2; ++kind)
        slope[kKinds[kind].correlated] +=
            6.0 - (errorAfter(0, kind).squaredNorm() +
                   P.diagonal[0].diagonal().segment<6>(kKinds[kind].offset).sum()) *
                      std::pow(sizeOf(kKinds[kind].correlated), -2.0);
    if (k + 1 < linear_.nodes.size()) {
      if (linear_.motions[k].known) motionSlope(k, P, &slope);
      decaySlope(k, P, &slope);
    }
    result.total += slope;
    while (block + 1 < block_begins.size() && block_begins[block + 1] <= k) ++block;
    if (!block_begins.empty()) result.of_blocks[block] += slope;
  }
  bandwidthSlope(P, block_begins, &result);
  for (int i = 0; i < kErrorSizes; ++i) {
    const bool known = priors_[i].log_sigma == 0.0;
    if (!known)
      result.total[i] += (log_sizes_[i] - std::log(priors_[i].value)) /
                         (priors_[i].log_sigma * priors_[i].log_sigma);
    if (known) result.total[i] = 0.0;
    for (SizeVector& of_block : result.of_blocks)
      if (known) of_block[i] = 0.0;
  }
  return result;
}

}  // namespace etalon::ground_truth
