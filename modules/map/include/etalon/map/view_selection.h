#pragma once

#include <vector>

#include "etalon/core/se3.h"
#include "etalon/map/map_options.h"

namespace etalon {

/** The view that the others can do without: the newer one of the two that are most alike in place
 * and direction.
 * @param T_WC at least two, oldest first */
size_t redundantView(const std::vector<SE3>& T_WC, const MapOptions& options);

}  // namespace etalon
