#pragma once

// What the checks of a recording write their sentences with. Private to the module.

#include <algorithm>
#include <cstdarg>
#include <cstddef>
#include <cstdio>
#include <string>
#include <vector>

namespace etalon {

/** printf into a string; cut after 600 characters. */
__attribute__((format(printf, 1, 2))) inline std::string format(const char* text, ...) {
  char buffer[600];
  va_list arguments;
  va_start(arguments, text);
  std::vsnprintf(buffer, sizeof buffer, text, arguments);
  va_end(arguments);
  return buffer;
}

/** The value in the middle, of an even number the upper one; 0 of none. */
inline double median(std::vector<double> values) {
  if (values.empty()) return 0;
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

}  // namespace etalon
