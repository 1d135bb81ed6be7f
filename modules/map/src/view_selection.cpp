#include "etalon/map/view_selection.h"

#include <cmath>
#include <limits>

#include "etalon/core/angles.h"
#include "etalon/core/so3.h"

namespace etalon {

size_t redundantView(const std::vector<SE3>& T_WC, const MapOptions& options) {
  double least = std::numeric_limits<double>::infinity();
  size_t redundant = T_WC.size() - 1;
  for (size_t j = 1; j < T_WC.size(); ++j)
    for (size_t i = 0; i < j; ++i) {
      const double apart = (T_WC[i].t - T_WC[j].t).norm() / options.spread_m;
      const double turned =
          degrees(angleBetween(T_WC[i].R.col(2), T_WC[j].R.col(2))) / options.spread_deg;
      const double distance = std::hypot(apart, turned);
      if (distance >= least) continue;
      least = distance;
      redundant = j;
    }
  return redundant;
}

}  // namespace etalon
