#include "stereo_pairs.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>

#include "etalon/core/statistics.h"
#include "etalon/core/text.h"

namespace etalon {

StereoPairs pairByStamps(const std::vector<TimeNs>& left, const std::vector<TimeNs>& right,
                         double tolerance_s) {
  const TimeNs tolerance = durationNs(tolerance_s);
  StereoPairs result;
  size_t l = 0, r = 0;
  while (l < left.size() && r < right.size()) {
    const TimeNs apart = std::abs(right[r] - left[l]);
    const bool later_right = r + 1 < right.size() && std::abs(right[r + 1] - left[l]) < apart;
    const bool later_left = l + 1 < left.size() && std::abs(right[r] - left[l + 1]) < apart;
    if (apart <= tolerance && !later_right && !later_left)
      result.pairs.emplace_back(l++, r++);
    else if (left[l] < right[r])
      result.alone_left.push_back(l++);
    else
      result.alone_right.push_back(r++);
  }
  for (; l < left.size(); ++l) result.alone_left.push_back(l);
  for (; r < right.size(); ++r) result.alone_right.push_back(r);

  std::vector<double> offsets;
  for (const auto& [i, j] : result.pairs) offsets.push_back(secondsBetween(left[i], right[j]));
  if (offsets.empty()) return result;
  result.offset_s = median(offsets);
  for (const double offset : offsets)
    result.spread_s = std::max(result.spread_s, std::abs(offset - result.offset_s));
  return result;
}

std::string describeOffset(const StereoPairs& pairs) {
  if (pairs.offset_s == 0.0 && pairs.spread_s == 0.0) return "";
  return format(
      "stamps of the right camera are %.4g ms after those of the left one (median; at most %.4g ms "
      "off it); a pair has the stamp of the left one",
      1e3 * pairs.offset_s, 1e3 * pairs.spread_s);
}

std::string adviseOnAlone(const StereoPairs& found, const std::vector<TimeNs>& left,
                          const std::vector<TimeNs>& right) {
  const size_t alone = found.alone_left.size();
  if (20 * alone <= left.size() || left.size() < 2) return "";
  std::vector<double> steps;
  for (size_t i = 1; i < left.size(); ++i) steps.push_back(secondsBetween(left[i - 1], left[i]));
  const double within_s = 0.5 * median(std::move(steps));
  if (2 * (pairByStamps(left, right, within_s).pairs.size() - found.pairs.size()) <= alone)
    return "";
  return format("%zu of %zu left images have no right one of the same stamp", alone, left.size()) +
         adviseTolerance(left, right, within_s);
}

std::string adviseTolerance(const std::vector<TimeNs>& left, const std::vector<TimeNs>& right,
                            double within_s) {
  if (left.empty() || right.empty()) return "";
  const StereoPairs nearest = pairByStamps(left, right, within_s);
  if (nearest.pairs.empty()) return "; the cameras do not overlap in time";
  double needed_s = 0.0;
  for (const auto& [l, r] : nearest.pairs)
    needed_s = std::max(needed_s, std::abs(secondsBetween(left[l], right[r])));
  return format(
      "; the nearest right stamp is %.4g ms after the left one (median): --pair-tolerance %.3f "
      "(ms) would pair %zu of them (info, replay and convert have it; the other commands take what "
      "convert has written)",
      1e3 * nearest.offset_s, 1e-3 * std::ceil(1e6 * needed_s), nearest.pairs.size());
}

}  // namespace etalon
