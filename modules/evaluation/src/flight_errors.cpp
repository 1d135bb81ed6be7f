#include "etalon/evaluation/flight_errors.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include "etalon/core/angles.h"
#include "etalon/core/yaw.h"

namespace etalon {
namespace {

using namespace state_index;

double rootOfSum(const Eigen::VectorXd& variances) {
  return std::sqrt(std::max(0.0, variances.sum()));
}

/** The predicted errors, which need no ground truth. */
FlightErrors predicted(const FrameEstimate& e) {
  FlightErrors result;
  const Eigen::Matrix3d P =
      e.nav.T_WB.R * e.pose_covariance.block<3, 3>(kRotation, kRotation) * e.nav.T_WB.R.transpose();
  result.tilt_deg.sigma = degrees(rootOfSum(P.diagonal().head<2>()));
  result.yaw_deg.sigma = degrees(rootOfSum(P.diagonal().tail<1>()));
  const Eigen::Matrix<double, 15, 1> variance = e.sigma().array().square();
  const auto sigmaOf = [&variance](int block) { return rootOfSum(variance.segment<3>(block)); };
  result.position_m.sigma = sigmaOf(kPosition);
  result.velocity_mps.sigma = sigmaOf(kVelocity);
  result.gyro_bias_rps.sigma = sigmaOf(kGyroBias);
  result.accel_bias_mps2.sigma = sigmaOf(kAccelBias);
  return result;
}

void addErrors(const NavState& estimate, const NavState& truth, const GroundTruth& ground_truth,
               FlightErrors* errors) {
  const Eigen::Matrix<double, 15, 1> d = estimate.minus(truth);
  const Eigen::Vector3d turned = truth.T_WB.R * d.segment<3>(kRotation);
  errors->position_m.error = d.segment<3>(kPosition).norm();
  errors->tilt_deg.error = degrees(turned.head<2>().norm());
  errors->yaw_deg.error = degrees(std::abs(turned.z()));
  if (ground_truth.has_velocity) errors->velocity_mps.error = d.segment<3>(kVelocity).norm();
  if (!ground_truth.has_biases) return;
  errors->gyro_bias_rps.error = d.segment<3>(kGyroBias).norm();
  errors->accel_bias_mps2.error = d.segment<3>(kAccelBias).norm();
}

}  // namespace

const std::vector<FlightFigure>& flightFigures() {
  static const std::vector<FlightFigure> figures = {
      {"position", "position since the start", "m", 1.0, &FlightErrors::position_m},
      {"velocity", "velocity", "m/s", 1.0, &FlightErrors::velocity_mps},
      {"tilt", "roll and pitch", "deg", 1.0, &FlightErrors::tilt_deg},
      {"yaw", "yaw since the start", "deg", 1.0, &FlightErrors::yaw_deg},
      {"gyro_bias", "gyro bias", "mrad/s", 1e3, &FlightErrors::gyro_bias_rps},
      {"accel_bias", "accelerometer bias", "m/s²", 1.0, &FlightErrors::accel_bias_mps2}};
  return figures;
}

std::vector<FlightErrors> flightErrors(const std::vector<FrameEstimate>& estimates,
                                       const GroundTruth& ground_truth) {
  std::vector<FlightErrors> all;
  all.reserve(estimates.size());
  std::optional<SE3> T_WG;  // since the last start
  for (const FrameEstimate& e : estimates) {
    all.emplace_back();
    if (!e.motion_variance.allFinite()) {  // stereo odometry, before a start
      T_WG.reset();
      continue;
    }
    all.back() = predicted(e);
    const auto truth = ground_truth.at(e.t);
    if (!truth) continue;
    if (!T_WG) T_WG = yawPositionAlignment(truth->T_WB, e.nav.T_WB);
    NavState truth_W = *truth;
    truth_W.T_WB = *T_WG * truth->T_WB;
    truth_W.v_WB = T_WG->R * truth->v_WB;
    addErrors(e.nav, truth_W, ground_truth, &all.back());
  }
  return all;
}

}  // namespace etalon
