#include "calibration/kalibr_camchain.h"

#include <cmath>
#include <sstream>

#include "calibration/yaml_map.h"
#include "etalon/core/so3.h"

namespace etalon {

namespace {

const char* const kCamera = "a camera of Kalibr's camchain";
const char* const kPose = "a 4x4 transform (16 numbers, row by row)";

/** T_C1I by way of the left camera, where the file has it. */
SE3 rightPose(const YamlMap& cam1, const SE3& T_C0I, KalibrCamchain* chain) {
  const bool direct = cam1.has("T_cam_imu");
  const std::string expected = std::string(kPose) + ", left to right camera";
  if (direct && !cam1.has("T_cn_cnm1")) return cam1.transform("T_cam_imu", kPose, &chain->warnings);
  SE3 T_C1I = cam1.transform("T_cn_cnm1", expected, &chain->warnings) * T_C0I;
  if (!direct) return T_C1I;
  SE3 given = cam1.transform("T_cam_imu", kPose, &chain->warnings);
  constexpr double kSame = 1e-4;  // rad and m: what rounded digits make is below
  const SE3 apart = given * T_C1I.inverse();
  if (logSO3(apart.R).norm() > kSame || apart.t.norm() > kSame)
    chain->warnings.push_back(cam1.path() +
                              ": T_cam_imu and T_cn_cnm1 of cam1 do not agree; T_cam_imu is used");
  return given;
}

}  // namespace

KalibrCamchain readKalibrCamchain(const std::string& path) {
  const YamlMap file(path);
  KalibrCamchain chain;
  for (size_t c = 0; c < 2; ++c) {
    const YamlMap camera = file.below("cam" + std::to_string(c), kCamera);
    chain.models[c] = readCameraModel(camera, "distortion_coeffs");
    chain.T_CI[c] = c == 0 ? camera.transform("T_cam_imu",
                                              std::string(kPose) + ", IMU to camera, as " +
                                                  "kalibr_calibrate_imu_camera writes it",
                                              &chain.warnings)
                           : rightPose(camera, chain.T_CI[0], &chain);
    if (camera.has("rostopic")) chain.topics[c] = camera.word("rostopic", "a topic");
    if (!camera.has("timeshift_cam_imu")) continue;
    const std::string expected = "at most 10 seconds, IMU less camera clock";
    chain.timeshift_s[c] = camera.number("timeshift_cam_imu", expected);
    if (std::abs(chain.timeshift_s[c]) > 10.0)
      camera.fail(camera.node("timeshift_cam_imu", ""),
                  "expected 'timeshift_cam_imu' to be " + expected);
  }
  return chain;
}

double imageTimeShift(const KalibrCamchain& chain, const std::string& path,
                      std::vector<std::string>* warnings) {
  const auto [shift_s, other_s] = chain.timeshift_s;
  constexpr double kSameShift = 5e-4;  // s
  if (std::abs(shift_s - other_s) > kSameShift)
    warnings->push_back(path + ": timeshift_cam_imu of cam0 and cam1 differ by " +
                        std::to_string(1e3 * std::abs(shift_s - other_s)) +
                        " ms; that of cam0 is used for both");
  if (shift_s != 0.0) {
    std::ostringstream shift_ms;
    shift_ms << 1e3 * shift_s;
    warnings->push_back(path + ": image stamps are moved by " + shift_ms.str() +
                        " ms to the IMU's clock (timeshift_cam_imu)");
  }
  return shift_s;
}

}  // namespace etalon
