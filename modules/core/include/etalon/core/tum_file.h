#pragma once

#include <string>

#include "etalon/core/trajectory.h"

namespace etalon {

/**
 * As writeTum() of trajectory.h, for poses that are not T_WB.
 * @param frames which poses they are, one line; the file begins with it
 */
void writeTum(const std::string& path, const Trajectory& trajectory, const std::string& frames);

}  // namespace etalon
