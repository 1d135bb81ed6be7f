#pragma once

#include <string>
#include <vector>

#include "etalon/evaluation/metrics.h"

namespace etalon {

/** One of the errors of a window, and how it is printed. */
struct WindowMetric {
  std::string key;              ///< as in files, e.g. "ate_m"
  std::string name;             ///< in words
  std::string title;            ///< of a column: short, with the unit it is printed in
  double WindowErrors::*error;  ///< where it is
  int decimals = 0;
  double factor = 1.0;  ///< from the key's unit to the title's

  /** The last digit that the tables print, in the key's unit. */
  double lastDigit() const;
};

/** All of them, in the order of the files. */
std::vector<WindowMetric> windowMetrics();

/** The errors over what the estimate claims (setNees()), in the order of the files. */
std::vector<WindowMetric> neesMetrics();

/** @throws ConfigError naming those that exist, if there is none of this key. */
WindowMetric windowMetric(const std::string& key);

}  // namespace etalon
