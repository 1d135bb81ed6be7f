#pragma once

// Every kind of camera: declared here once, listed once. Private to the module.

#include "etalon/core/camera_model.h"

namespace etalon {

CameraKind pinholeRadtan();
CameraKind equidistant();
CameraKind pinholeRadtanK3();

inline std::vector<CameraKind> allCameraKinds() {
  return {pinholeRadtan(), equidistant(), pinholeRadtanK3()};
}

}  // namespace etalon
