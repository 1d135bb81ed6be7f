#pragma once

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

namespace etalon {

/** The value in the middle, of an even number the upper one; NaN of none, or if one is NaN. */
inline double median(std::vector<double> values) {
  const auto is_nan = [](double v) { return std::isnan(v); };
  if (values.empty() || std::any_of(values.begin(), values.end(), is_nan))
    return std::numeric_limits<double>::quiet_NaN();
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

}  // namespace etalon
