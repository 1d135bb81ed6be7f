#include "etalon/runlog/states_csv.h"

#include <Eigen/Geometry>

#include "etalon/core/angles.h"
#include "etalon/core/text.h"
#include "etalon/imu/preintegration.h"

namespace etalon {
namespace {

using namespace state_index;

constexpr const char* kHeader =
    "t_ns,state,p_x_m,p_y_m,p_z_m,q_x,q_y,q_z,q_w,v_x_mps,v_y_mps,v_z_mps,"
    "b_g_x_rps,b_g_y_rps,b_g_z_rps,b_a_x_mps2,b_a_y_mps2,b_a_z_mps2,"
    "sigma_rotation_x_deg,sigma_rotation_y_deg,sigma_rotation_z_deg,"
    "sigma_p_x_m,sigma_p_y_m,sigma_p_z_m,sigma_v_x_mps,sigma_v_y_mps,sigma_v_z_mps,"
    "sigma_b_g_x_rps,sigma_b_g_y_rps,sigma_b_g_z_rps,"
    "sigma_b_a_x_mps2,sigma_b_a_y_mps2,sigma_b_a_z_mps2\n";

}  // namespace

std::string statesCsv(const std::vector<FrameEstimate>& estimates) {
  std::string text = kHeader;
  for (const FrameEstimate& e : estimates) {
    text += std::to_string(e.t) + "," + toString(e.state);
    const auto add = [&text](double value) { text += "," + csvNumber(value); };
    const auto addAll = [&add](const auto& values) {
      for (int i = 0; i < values.size(); ++i) add(values[i]);
    };
    addAll(e.nav.T_WB.t);
    addAll(Eigen::Quaterniond(e.nav.T_WB.R).coeffs());
    Eigen::Matrix<double, 15, 1> sigma = e.sigma();
    const bool inertial = sigma.allFinite();
    const Eigen::Vector3d unknown = Eigen::Vector3d::Constant(FrameEstimate::kUnknown);
    addAll(inertial ? e.nav.v_WB : unknown);
    addAll(inertial ? e.nav.bias.gyro : unknown);
    addAll(inertial ? e.nav.bias.accel : unknown);
    sigma.segment<3>(kRotation) *= kDegreesPerRadian;
    addAll(sigma);
    text += "\n";
  }
  return text;
}

std::string imuStatesCsv(const std::vector<ImuRateState>& states) {
  std::string text = "t_ns,state,p_x_m,p_y_m,p_z_m,q_x,q_y,q_z,q_w,v_x_mps,v_y_mps,v_z_mps\n";
  for (const ImuRateState& s : states) {
    text += std::to_string(s.t) + "," + toString(s.state);
    const auto addAll = [&text](const auto& values) {
      for (int i = 0; i < values.size(); ++i) text += "," + csvNumber(values[i]);
    };
    addAll(s.nav.T_WB.t);
    addAll(Eigen::Quaterniond(s.nav.T_WB.R).coeffs());
    addAll(s.nav.v_WB);
    text += "\n";
  }
  return text;
}

}  // namespace etalon
