#include "etalon/simulation/fisheye_rig.h"

#include "etalon/simulation/euroc_rig.h"

namespace etalon {

StereoInertialCalibration fisheyeCalibration() {
  StereoInertialCalibration rig = eurocCalibration();
  rig.cameras[0].model =
      CameraModel("pinhole", "equidistant", 512, 512, {191.0, 190.9, 254.9, 256.9},
                  {0.0035, 0.0007, -0.0021, 0.0002});
  rig.cameras[1].model =
      CameraModel("pinhole", "equidistant", 512, 512, {190.4, 190.4, 252.6, 254.9},
                  {0.0034, 0.0018, -0.0027, 0.0003});
  return rig;
}

}  // namespace etalon
