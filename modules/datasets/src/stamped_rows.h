#pragma once

#include <algorithm>
#include <string>
#include <utility>
#include <vector>

#include "etalon/core/statistics.h"
#include "etalon/core/time.h"

namespace etalon {

/** Steps between the stamps `t` of rows, s; 0 of a single row. */
struct Steps {
  double median_s = 0.0, mean_s = 0.0;

  /** Most are short, some long: so are stamps of the arrival in batches. */
  bool inBatches() const { return median_s < 0.5 * mean_s; }
  /** One over the median step, in batches over the mean one; 0 of a single row. */
  double rateHz() const {
    const double step_s = inBatches() ? mean_s : median_s;
    return step_s > 0.0 ? 1.0 / step_s : 0.0;
  }
};

template <typename Row>
Steps stepsOf(const std::vector<Row>& rows) {
  if (rows.size() < 2) return {};
  std::vector<double> steps_s;
  for (size_t i = 1; i < rows.size(); ++i)
    steps_s.push_back(secondsBetween(rows[i - 1].t, rows[i].t));
  const double mean_s = secondsBetween(rows.front().t, rows.back().t) / steps_s.size();
  return {median(std::move(steps_s)), mean_s};
}

template <typename Row>
double measuredRate(const std::vector<Row>& rows) {
  return stepsOf(rows).rateHz();
}

/** Adds `shift` to the stamps of rows; those whose stamp becomes an impossible one are left out, with
 * a warning. */
template <typename Row>
void shiftStamps(TimeNs shift, const std::string& name, std::vector<Row>* rows,
                 std::vector<std::string>* warnings) {
  const size_t before = rows->size();
  for (Row& row : *rows) row.t += shift;
  rows->erase(
      std::remove_if(rows->begin(), rows->end(), [](const Row& row) { return !isStamp(row.t); }),
      rows->end());
  if (rows->size() != before)
    warnings->push_back(name + ": " + std::to_string(before - rows->size()) +
                        " images are left out: timeshift_cam_imu gives them a stamp before 0");
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
