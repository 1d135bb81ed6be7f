#pragma once

#include <cmath>

namespace etalon {

constexpr double kDegreesPerRadian = 180.0 / M_PI;

constexpr double degrees(double radians) { return radians * kDegreesPerRadian; }
constexpr double radians(double degrees) { return degrees * (M_PI / 180.0); }

}  // namespace etalon
