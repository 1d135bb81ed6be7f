#include "bundle/residual_list.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "etalon/optimization/residuals/huber.h"

namespace etalon {

const StateBlocks::Block& StateBlocks::of(const double* values) const {
  const auto found = std::find_if(blocks_.begin(), blocks_.end(),
                                  [&](const Block& block) { return block.values == values; });
  if (found == blocks_.end())
    throw std::logic_error("a residual that is not eliminated has a block that is no state");
  return *found;
}

void ResidualList::addTo(ceres::Problem* problem, const StateBlocks& state) {
  for (const StateBlocks::Block& block : state.all()) {
    if (block.isPose())
      problem->AddParameterBlock(block.values, block.size, &manifold_);
    else
      problem->AddParameterBlock(block.values, block.size);
  }
  losses_.clear();
  for (const ResidualBlock& block : blocks_) {
    losses_.push_back(std::isfinite(block.huber) ? std::make_unique<ceres::HuberLoss>(block.huber)
                                                 : nullptr);
    problem->AddResidualBlock(block.cost.get(), losses_.back().get(), block.parameters);
  }
}

namespace {

/** Jacobian by the tangent of what Ceres has by the numbers of the block. */
Eigen::MatrixXd byTangent(const StateBlocks::Block& block, const ceres::Manifold& manifold,
                          const RowMajor<Eigen::Dynamic, Eigen::Dynamic>& J) {
  if (!block.isPose()) return J;
  RowMajor<7, 6> plus;
  manifold.PlusJacobian(block.values, plus.data());
  return J * plus;
}

}  // namespace

std::vector<LinearizedResidual> ResidualList::linearize(const StateBlocks& state) const {
  std::vector<LinearizedResidual> result;
  for (const ResidualBlock& block : blocks_) {
    if (block.kind == ResidualKind::kEliminated) continue;
    const int rows = block.cost->num_residuals();
    std::vector<RowMajor<Eigen::Dynamic, Eigen::Dynamic>> J;
    for (const int size : block.cost->parameter_block_sizes()) J.emplace_back(rows, size);
    std::vector<double*> J_data;
    for (auto& of_block : J) J_data.push_back(of_block.data());
    LinearizedResidual linearized{block.kind, Eigen::VectorXd(rows), {}, 1.0};
    block.cost->Evaluate(block.parameters.data(), linearized.r.data(), J_data.data());
    linearized.weight = huberWeight(linearized.r.norm(), block.huber);
    for (size_t i = 0; i < J.size(); ++i) {
      const StateBlocks::Block& of = state.of(block.parameters[i]);
      linearized.parts.push_back({of.column, byTangent(of, manifold_, J[i])});
    }
    result.push_back(std::move(linearized));
  }
  return result;
}

Eigen::MatrixXd timesCovariance(const LinearizedResidual& a, const Eigen::MatrixXd& P) {
  Eigen::MatrixXd JP = Eigen::MatrixXd::Zero(a.r.size(), P.cols());
  for (const LinearizedResidual::Part& part : a.parts)
    JP.noalias() += part.J * P.middleRows(part.column, part.J.cols());
  return JP;
}

Eigen::MatrixXd timesTransposed(const Eigen::MatrixXd& JP, const LinearizedResidual& b) {
  Eigen::MatrixXd JPJ = Eigen::MatrixXd::Zero(JP.rows(), b.r.size());
  for (const LinearizedResidual::Part& part : b.parts)
    JPJ.noalias() += JP.middleCols(part.column, part.J.cols()) * part.J.transpose();
  return JPJ;
}

void addInformation(const std::vector<LinearizedResidual>& residuals, NormalEquations* equations) {
  for (const LinearizedResidual& residual : residuals)
    for (const LinearizedResidual::Part& a : residual.parts)
      for (const LinearizedResidual::Part& b : residual.parts)
        equations->add(a.column, b.column, residual.weight * a.J.transpose() * b.J);
}

}  // namespace etalon
