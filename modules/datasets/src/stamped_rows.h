#pragma once

#include <algorithm>
#include <string>
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

/**
 * Brings rows into the order of their stamps `t`, and drops those with the stamp of the one before,
 * or with one that cannot be.
 * @param name of what holds the rows, @param rows_name of the rows themselves ("messages"), for the
 * warnings; null: nothing is said
 */
template <typename Row>
void putInOrder(const std::string& name, const std::string& rows_name, std::vector<Row>* rows,
                std::vector<std::string>* warnings) {
  const size_t before = rows->size();
  const auto earlier = [](const Row& a, const Row& b) { return a.t < b.t; };
  const bool sorted = std::is_sorted(rows->begin(), rows->end(), earlier);
  if (!sorted) std::stable_sort(rows->begin(), rows->end(), earlier);
  const auto same = [](const Row& a, const Row& b) { return a.t == b.t; };
  rows->erase(std::unique(rows->begin(), rows->end(), same), rows->end());
  rows->erase(
      std::remove_if(rows->begin(), rows->end(), [](const Row& row) { return !isStamp(row.t); }),
      rows->end());
  if (!warnings) return;
  if (!sorted)
    warnings->push_back(name + ": " + rows_name + " were not in the order of their stamps");
  if (rows->size() != before)
    warnings->push_back(name + ": " + std::to_string(before - rows->size()) + " " + rows_name +
                        " with the stamp of another one, or an impossible one, are left out");
}

}  // namespace etalon
