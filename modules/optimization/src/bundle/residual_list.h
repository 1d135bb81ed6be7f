#pragma once

// The residuals of a problem, each stated once: the solver, the covariance and the noise check read
// this list. Private to the module.

#include <ceres/cost_function.h>
#include <ceres/loss_function.h>
#include <ceres/problem.h>

#include <Eigen/Core>
#include <limits>
#include <memory>
#include <vector>

#include "etalon/optimization/bundle/normal_equations.h"
#include "residuals/pose_manifold.h"

namespace etalon {

/** What the rows of a residual are, for the covariance and the noise check. */
enum class ResidualKind {
  kImu,         ///< three rows of gyro noise, then six of the accelerometer given those
  kPrior,       ///< what is believed or fixed: no sensor's noise
  kEliminated,  ///< ties an unknown that is no state; eliminated apart, with the landmarks
};

struct ResidualBlock {
  std::unique_ptr<ceres::CostFunction> cost;  ///< whitened
  std::vector<double*> parameters;            ///< blocks of StateBlocks, or eliminated ones
  ResidualKind kind = ResidualKind::kPrior;
  double huber = std::numeric_limits<double>::infinity();  ///< width in sigmas
};

/** The state's parameter blocks in the order of the normal equations. */
class StateBlocks {
 public:
  void addPose(double* block) { add(block, 7, 6); }
  void addVector(double* block, int size) { add(block, size, size); }

  struct Block {
    double* values;
    int size, tangent;
    Eigen::Index column;
    bool isPose() const { return size != tangent; }
  };
  const std::vector<Block>& all() const { return blocks_; }
  /** Tangent dimension of all together. */
  Eigen::Index columns() const { return columns_; }
  /** @throws std::logic_error if it is none of them */
  const Block& of(const double* values) const;

 private:
  void add(double* values, int size, int tangent) {
    blocks_.push_back({values, size, tangent, columns_});
    columns_ += tangent;
  }
  std::vector<Block> blocks_;
  Eigen::Index columns_ = 0;
};

/** A whitened residual and its derivatives by the state, at the state's values. */
struct LinearizedResidual {
  struct Part {
    Eigen::Index column;  ///< in the normal equations
    Eigen::MatrixXd J;    ///< by the tangent
  };
  ResidualKind kind;
  Eigen::VectorXd r;
  std::vector<Part> parts;
  double weight = 1.0;  ///< Huber's in the normal equations
};

class ResidualList {
 public:
  void clear() { blocks_.clear(); }
  void add(ResidualBlock block) { blocks_.push_back(std::move(block)); }

  /** Adds the state's blocks and all residuals to a problem that owns neither. */
  void addTo(ceres::Problem* problem, const StateBlocks& state);

  /** All that are not eliminated, in their order. */
  std::vector<LinearizedResidual> linearize(const StateBlocks& state) const;

 private:
  std::vector<ResidualBlock> blocks_;
  std::vector<std::unique_ptr<ceres::LossFunction>> losses_;  ///< one a block, null: squares
  PoseManifold manifold_;
};

/** J P, all columns. */
Eigen::MatrixXd timesCovariance(const LinearizedResidual& a, const Eigen::MatrixXd& P);

/** J P J_b^T of `JP`. */
Eigen::MatrixXd timesTransposed(const Eigen::MatrixXd& JP, const LinearizedResidual& b);

/** Adds what the residuals say of the state. */
void addInformation(const std::vector<LinearizedResidual>& residuals, NormalEquations* equations);

}  // namespace etalon
