#include "size_search.h"

#include <ceres/gradient_problem.h>
#include <ceres/gradient_problem_solver.h>

#include "etalon/core/symmetric.h"

namespace etalon::ground_truth {
namespace {

/** Sizes further than so from where their prior is are not tried: a factor of e^12. */
constexpr double kFurthest = 12.0;
/** A search that has not ended by then stays where it is best. */
constexpr int kMostEvaluations = 80;
/** Step of the differences of the slope, in the logarithm. */
constexpr double kStep = 0.1;
/** Of the objective by a size that is known. */
constexpr double kKnownCurvature = 1e12;

class Objective final : public ceres::FirstOrderFunction {
 public:
  Objective(Likelihood* likelihood, double scale) : likelihood_(likelihood), scale_(scale) {}

  bool Evaluate(const double* parameters, double* cost, double* gradient) const override {
    if (++evaluations_ > kMostEvaluations) return false;
    const SizeVector log_sizes = Eigen::Map<const SizeVector>(parameters);
    if (!((log_sizes - logOf(likelihood_->priors())).cwiseAbs().maxCoeff() < kFurthest))
      return false;
    Posterior posterior;
    if (!likelihood_->solve(log_sizes, &posterior)) return false;
    *cost = scale_ * posterior.objective;
    if (gradient) {
      Eigen::Map<SizeVector> slope(gradient);
      slope = scale_ * likelihood_->slope().total;
    }
    return true;
  }
  int NumParameters() const override { return kErrorSizes; }

 private:
  Likelihood* likelihood_;
  double scale_;
  mutable int evaluations_ = 0;
};

}  // namespace

SizeSearch searchSizes(Likelihood* likelihood, const SizeVector& start) {
  // Scaled so that the search's first step, the slope itself, is of the order of one.
  const double scale = 1.0 / static_cast<double>(likelihood->believedRows());
  ceres::GradientProblem problem(new Objective(likelihood, scale));
  ceres::GradientProblemSolver::Options options;
  options.line_search_direction_type = ceres::BFGS;
  options.max_num_iterations = 40;
  options.max_num_line_search_step_size_iterations = 8;
  options.function_tolerance = 1e-8;
  options.gradient_tolerance = 0.05 * scale;  // of a logarithm known to 0.1: 0.0005 from the best
  options.logging_type = ceres::SILENT;
  SizeSearch result;
  result.log_sizes = start;
  ceres::GradientProblemSolver::Summary summary;
  ceres::Solve(options, problem, result.log_sizes.data(), &summary);
  result.evaluations = summary.num_cost_evaluations;
  return result;
}

SizeUncertainty sizeUncertainty(Likelihood* likelihood, const SizeVector& log_sizes,
                                const std::vector<size_t>& block_begins) {
  SizeMatrix curvature;
  SizeUncertainty result;
  Posterior up, down;
  result.border_by_size.setZero();
  for (int i = 0; i < kErrorSizes; ++i) {
    if (likelihood->priors()[i].log_sigma == 0.0) {
      curvature.col(i) = kKnownCurvature * SizeVector::Unit(i);
      continue;
    }
    const SizeVector step = kStep * SizeVector::Unit(i);
    likelihood->solve(log_sizes + step, &up);
    const SizeVector slope_up = likelihood->slope().total;
    likelihood->solve(log_sizes - step, &down);
    curvature.col(i) = (slope_up - likelihood->slope().total) / (2.0 * kStep);
    result.border_by_size.col(i) = (up.border - down.border) / (2.0 * kStep);
  }
  curvature = (0.5 * (curvature + curvature.transpose())).eval();
  // A direction that the data leave open has at least the curvature of a factor of e^3.
  const SymmetricEigen eigen = symmetricEigen(curvature);
  const SizeVector inverse = eigen.values.cwiseMax(1.0 / 9.0).cwiseInverse();
  result.covariance = eigen.vectors * inverse.asDiagonal() * eigen.vectors.transpose();

  likelihood->solve(log_sizes, &up);
  const Slope slope = likelihood->slope(block_begins);
  SizeMatrix scatter = SizeMatrix::Zero();
  const double n = static_cast<double>(block_begins.size());
  SizeVector mean = SizeVector::Zero();
  for (const SizeVector& block : slope.of_blocks) mean += block / n;
  for (const SizeVector& block : slope.of_blocks)
    scatter += (block - mean) * (block - mean).transpose() * (n / (n - 1.0));
  result.robust = result.covariance * scatter * result.covariance;
  return result;
}

}  // namespace etalon::ground_truth
