#include "etalon/evaluation/consistency.h"

#include <Eigen/Cholesky>
#include <optional>

#include "etalon/initialization/estimation_error.h"

namespace etalon {
namespace {

/** e^T P^-1 e / n; NaN where P is not positive definite. */
double neesOf(const Eigen::VectorXd& error, const Eigen::MatrixXd& covariance) {
  const Eigen::LLT<Eigen::MatrixXd> factor(covariance);
  if (!covariance.allFinite() || factor.info() != Eigen::Success) return WindowErrors::kNone;
  return error.dot(factor.solve(error)) / static_cast<double>(error.size());
}

}  // namespace

void setNees(const std::vector<StampedState>& states, const ImuBias& bias,
             const GroundTruth& ground_truth, const Eigen::MatrixXd& covariance,
             WindowErrors* errors) {
  if (states.empty() || covariance.rows() < 11) return;
  const std::optional<StampedState> first = ground_truth.at(states.front().t),
                                    last = ground_truth.at(states.back().t);
  WindowTruth truth;
  if (first) truth.R_WB0 = first->T_WB.R;
  if (last) truth.v_WB = last->v_WB;
  int count = 0;
  for (const StampedState& state : states)
    if (const std::optional<StampedState> at = ground_truth.at(state.t)) {
      truth.bias.gyro += at->bias.gyro;
      truth.bias.accel += at->bias.accel;
      ++count;
    }
  if (count > 0) {
    truth.bias.gyro /= count;
    truth.bias.accel /= count;
  }
  const Eigen::Matrix<double, 11, 1> error = estimationError(states, bias, truth);
  const auto nees = [&](Eigen::Index start, Eigen::Index size) {
    return neesOf(error.segment(start, size), covariance.block(start, start, size, size));
  };
  if (ground_truth.has_biases && count > 0) {
    errors->gyro_bias_nees = nees(0, 3);
    errors->accel_bias_nees = nees(3, 3);
  }
  if (first) errors->tilt_nees = nees(6, 2);
  if (first && last && ground_truth.has_velocity) errors->velocity_nees = nees(8, 3);
}

}  // namespace etalon
