#include "etalon/core/statistics.h"

#include <algorithm>
#include <boost/math/distributions/chi_squared.hpp>
#include <cmath>
#include <limits>

namespace etalon {

namespace {

/** NaN cannot be sorted. */
bool haveAnOrder(const std::vector<double>& values) {
  return !values.empty() &&
         std::none_of(values.begin(), values.end(), [](double v) { return std::isnan(v); });
}

}  // namespace

double median(std::vector<double> values) {
  if (!haveAnOrder(values)) return std::numeric_limits<double>::quiet_NaN();
  const auto middle = values.begin() + values.size() / 2;
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

double quantile(std::vector<double> values, double q) {
  if (!haveAnOrder(values)) return std::numeric_limits<double>::quiet_NaN();
  const double position = q * static_cast<double>(values.size() - 1);
  const auto below = values.begin() + position;
  std::nth_element(values.begin(), below, values.end());
  if (below + 1 == values.end()) return *below;
  const double above = *std::min_element(below + 1, values.end());
  return *below + (position - std::floor(position)) * (above - *below);
}

double meanUpTo(double largest, const std::vector<double>& values) {
  double sum = 0.0, count = 0.0;
  for (const double value : values) {
    if (!(value <= largest)) continue;
    sum += value;
    count += 1.0;
  }
  return sum / count;
}

double chiSquareQuantile(double dof, double tail) {
  return boost::math::quantile(
      boost::math::complement(boost::math::chi_squared_distribution<double>(dof), tail));
}

}  // namespace etalon
