#include "etalon/simulation/euroc_rig.h"

namespace etalon {

StereoInertialCalibration eurocCalibration() {
  StereoInertialCalibration rig;
  CameraCalibration& left = rig.cameras[0];
  left.model =
      CameraModel("pinhole", "radial-tangential", 752, 480, {458.654, 457.296, 367.215, 248.375},
                  {-0.28340811, 0.07395907, 0.00019359, 1.76187114e-05});
  left.T_BC.R << 0.0148655429818, -0.999880929698, 0.00414029679422,  //
      0.999557249008, 0.0149672133247, 0.025715529948,                //
      -0.0257744366974, 0.00375618835797, 0.999660727178;
  left.T_BC.t << -0.0216401454975, -0.064676986768, 0.00981073058949;

  CameraCalibration& right = rig.cameras[1];
  right.model =
      CameraModel("pinhole", "radial-tangential", 752, 480, {457.587, 456.134, 379.999, 255.238},
                  {-0.28368365, 0.07451284, -0.00010473, -3.55590700e-05});
  right.T_BC.R << 0.0125552670891, -0.999755099723, 0.0182237714554,  //
      0.999598781151, 0.0130119051815, 0.0251588363115,               //
      -0.0253898008918, 0.0179005838253, 0.999517347078;
  right.T_BC.t << -0.0198435579556, 0.0453689425024, 0.00786212447038;
  return rig;  // rates and IMU noise: the defaults of their types are EuRoC's
}

}  // namespace etalon
