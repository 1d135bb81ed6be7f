#include "etalon/runlog/states_csv.h"

#include <Eigen/Geometry>

#include "etalon/core/angles.h"
#include "etalon/core/output_file.h"
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

constexpr const char* kImuRateHeader =
    "t_ns,state,p_x_m,p_y_m,p_z_m,q_x,q_y,q_z,q_w,v_x_mps,v_y_mps,v_z_mps\n";

/** Writes the header, and for each element the line that `lineOf` makes, which ends without "\n". */
template <typename Element, typename LineOf>
void writeCsv(const std::string& path, const char* header, const std::vector<Element>& elements,
              const LineOf& lineOf) {
  OutputFile file(path);
  file.stream() << header;
  for (const Element& element : elements) file.stream() << lineOf(element) << '\n';
  if (!file.stream()) file.fail();
  file.putInPlace();
}

template <typename Values>
void appendCells(const Values& values, std::string* line) {
  for (int i = 0; i < values.size(); ++i) *line += "," + csvNumber(values[i]);
}

/** Stamp, state, position and quaternion. */
template <typename Element>
std::string firstCells(const Element& e) {
  std::string line = std::to_string(e.t) + "," + toString(e.state);
  appendCells(e.nav.T_WB.t, &line);
  appendCells(Eigen::Quaterniond(e.nav.T_WB.R).coeffs(), &line);
  return line;
}

}  // namespace

void writeStatesCsv(const std::string& path, const std::vector<FrameEstimate>& estimates) {
  writeCsv(path, kHeader, estimates, [](const FrameEstimate& e) {
    std::string line = firstCells(e);
    Eigen::Matrix<double, 15, 1> sigma = e.sigma();
    const bool inertial = sigma.allFinite();
    const Eigen::Vector3d unknown = Eigen::Vector3d::Constant(FrameEstimate::kUnknown);
    appendCells(inertial ? e.nav.v_WB : unknown, &line);
    appendCells(inertial ? e.nav.bias.gyro : unknown, &line);
    appendCells(inertial ? e.nav.bias.accel : unknown, &line);
    sigma.segment<3>(kRotation) *= kDegreesPerRadian;
    appendCells(sigma, &line);
    return line;
  });
}

void writeImuStatesCsv(const std::string& path, const std::vector<ImuRateState>& states) {
  writeCsv(path, kImuRateHeader, states, [](const ImuRateState& s) {
    std::string line = firstCells(s);
    appendCells(s.nav.v_WB, &line);
    return line;
  });
}

}  // namespace etalon
