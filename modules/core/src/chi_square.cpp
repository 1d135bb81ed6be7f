#include "etalon/core/chi_square.h"

#include <algorithm>
#include <cmath>

namespace etalon {

double normalQuantile(double tail) {
  double low = -8.0, high = 8.0;
  for (int i = 0; i < 60; ++i) {
    const double middle = 0.5 * (low + high);
    (0.5 * std::erfc(middle / std::sqrt(2.0)) > tail ? low : high) = middle;
  }
  return 0.5 * (low + high);
}

double chiSquareQuantile(double dof, double z) {
  const double c = 2.0 / (9.0 * dof);
  return dof * std::pow(std::max(0.0, 1.0 - c + z * std::sqrt(c)), 3);
}

}  // namespace etalon
