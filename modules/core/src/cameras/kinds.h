#pragma once

// Every kind of camera: declared here once, listed once. Private to the module.

#include "etalon/core/camera_model.h"

namespace etalon {

CameraKind pinholeRadtan();
CameraKind equidistant();

inline std::vector<CameraKind> allCameraKinds() { return {pinholeRadtan(), equidistant()}; }

}  // namespace etalon
