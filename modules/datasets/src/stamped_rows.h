#pragma once

#include <utility>
#include <vector>

#include "etalon/core/statistics.h"
#include "etalon/core/time.h"

namespace etalon {

/** One over the median step of rows with stamps `t`, Hz; 0 of a single row. */
template <typename Row>
double measuredRate(const std::vector<Row>& rows) {
  std::vector<double> steps_ns;
  for (size_t i = 1; i < rows.size(); ++i)
    steps_ns.push_back(static_cast<double>(rows[i].t - rows[i - 1].t));
  return steps_ns.empty() ? 0.0 : 1.0 / (median(std::move(steps_ns)) * 1e-9);
}

/** The stamps `t` of rows. */
template <typename Row>
std::vector<TimeNs> stampsOf(const std::vector<Row>& rows) {
  std::vector<TimeNs> stamps;
  for (const Row& row : rows) stamps.push_back(row.t);
  return stamps;
}

}  // namespace etalon
