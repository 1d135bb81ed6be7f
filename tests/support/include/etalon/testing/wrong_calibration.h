#pragma once

// A calibration that is wrong by a stated amount, and what an odometry that is given it should
// find. For the tests and benchmarks of odometry.

#include <cmath>
#include <map>
#include <string>

#include "etalon/core/angles.h"
#include "etalon/core/calibration.h"
#include "etalon/core/so3.h"
#include "etalon/odometry/fixed_lag/online_calibration.h"

namespace etalon::testing {

/** The deviations that make the given calibration right, in the units of CalibrationFinding. */
struct WrongCalibration {
  double time_offset = 0.0;      ///< ms; of SimulatedFlightOptions::time_offset_s
  double camera_rotation = 0.0;  ///< of the cameras in the body, about every axis, deg
  double stereo_rotation = 0.0;  ///< between the cameras, about every axis, deg
  double baseline = 0.0;         ///< %
  double focal = 0.0;            ///< %
  double radial = 0.0;           ///< k1 of both lenses: shift at half of the image's width, px
  double radial_k3 = 0.0;        ///< k3 of both lenses, the same

  /** By the names of programs' arguments. */
  std::map<std::string, double*> numbers() {
    return {{"time_offset", &time_offset},
            {"camera_rotation", &camera_rotation},
            {"stereo_rotation", &stereo_rotation},
            {"baseline", &baseline},
            {"focal", &focal},
            {"radial", &radial},
            {"radial_k3", &radial_k3}};
  }

  StereoInertialCalibration given(const StereoInertialCalibration& right) const {
    StereoInertialCalibration given = right;
    SE3 T_C0C1 = right.rightFromLeft().inverse();
    const auto turn = [](double deg) { return expSO3(-radians(deg) * Eigen::Vector3d::Ones()); };
    given.cameras[0].T_BC.R *= turn(camera_rotation);
    T_C0C1.R *= turn(stereo_rotation);
    T_C0C1.t /= 1.0 + 0.01 * baseline;
    given.cameras[1].T_BC = given.cameras[0].T_BC * T_C0C1;
    for (CameraCalibration& camera : given.cameras) {
      for (const char* name : {"fu", "fv"})
        camera.model = camera.model.with(name, camera.model.parameter(name) / (1.0 + 0.01 * focal));
      const double f = camera.model.focal().x(), r = 0.5 * camera.model.width() / f;
      camera.model =
          camera.model.with("k1", camera.model.parameter("k1") - radial / (f * std::pow(r, 3)));
      if (radial_k3 == 0.0) continue;
      camera.model = withThirdRadial(camera.model).with("k3", -radial_k3 / (f * std::pow(r, 7)));
    }
    return given;
  }

  /** Of every number of what was found. */
  Eigen::VectorXd deviation(const CalibrationFinding& finding) const {
    const std::string& quantity = finding.quantity;
    if (quantity == "radial distortion") {  // at a sixth, a third and half of the width
      Eigen::Vector3d shifts;
      for (int i = 0; i < 3; ++i) {
        const double part = (i + 1) / 3.0;
        shifts[i] = radial * std::pow(part, 3) + radial_k3 * std::pow(part, 7);
      }
      return (Eigen::VectorXd(6) << shifts, shifts).finished();
    }
    const double number = quantity == "time offset"                           ? time_offset
                          : quantity == "rotation of the cameras in the body" ? camera_rotation
                          : quantity == "rotation between the cameras"        ? stereo_rotation
                          : quantity == "baseline"                            ? baseline
                          : quantity == "focal lengths"                       ? focal
                                                                              : 0.0;
    return Eigen::VectorXd::Constant(finding.value.size(), number);
  }
};

}  // namespace etalon::testing
