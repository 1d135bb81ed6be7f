#include <algorithm>
#include <filesystem>
#include <fstream>

#include "etalon/core/text.h"
#include "etalon/datasets/recording_checks.h"

namespace etalon {

namespace {

/** Whether two files have the same content. */
bool sameContent(const std::string& a, const std::string& b) {
  std::error_code error;
  if (a.empty() || b.empty()) return false;
  const auto size_a = std::filesystem::file_size(a, error);
  if (error || size_a != std::filesystem::file_size(b, error) || error) return false;
  if (std::filesystem::equivalent(a, b, error)) return true;
  std::ifstream in_a(a, std::ios::binary), in_b(b, std::ios::binary);
  std::vector<char> buffer_a(1 << 16), buffer_b(1 << 16);
  while (in_a && in_b) {
    in_a.read(buffer_a.data(), static_cast<std::streamsize>(buffer_a.size()));
    in_b.read(buffer_b.data(), static_cast<std::streamsize>(buffer_b.size()));
    if (in_a.gcount() != in_b.gcount() ||
        !std::equal(buffer_a.begin(), buffer_a.begin() + in_a.gcount(), buffer_b.begin()))
      return false;
  }
  return in_a.eof() && in_b.eof();
}

/** Whether the gyro turned between two stamps: a rate above any bias of a sensor in use. */
bool turns(const std::vector<ImuSample>& imu, TimeNs t0, TimeNs t1) {
  constexpr double kTurningRps = 0.15;
  auto sample = std::lower_bound(imu.begin(), imu.end(), t0,
                                 [](const ImuSample& s, TimeNs t) { return s.t < t; });
  for (; sample != imu.end() && sample->t <= t1; ++sample)
    if (sample->gyro.norm() > kTurningRps) return true;
  return false;
}

}  // namespace

RecordingFindings checkRepeatedImages(const RecordedSource& source) {
  RecordingFindings findings;
  const std::vector<TimeNs>& stamps = source.imageStamps();
  const std::vector<ImuSample> imu = source.imuMeasurements();
  size_t repeated = 0, by_both = 0;
  TimeNs first = 0;
  for (size_t i = 1; i < stamps.size(); ++i) {
    if (!turns(imu, stamps[i - 1], stamps[i])) continue;
    const auto before = source.framePaths(i - 1), now = source.framePaths(i);
    const bool left = sameContent(before.first, now.first);
    const bool right = sameContent(before.second, now.second);
    if (!left && !right) continue;
    if (repeated++ == 0) first = stamps[i];
    by_both += left && right;
  }
  if (repeated == 0) return findings;
  const std::string sentence =
      source.name() + format(
                          ": images: %zu of %zu pairs repeat an image of the pair before while "
                          "the gyro turns, the first at stamp %lld; does the camera hang?",
                          repeated, stamps.size(), static_cast<long long>(first));
  // One camera is enough to fly.
  (2 * by_both > stamps.size() ? findings.errors : findings.warnings).push_back(sentence);
  return findings;
}

}  // namespace etalon
