#pragma once

#include <array>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "run_command.h"

namespace etalon::testing {

/** The recordings that the build renders for these tests. */
inline const std::string kFlight = ETALON_RENDERED "/flight";
inline const std::string kFisheye = ETALON_RENDERED "/fisheye";
inline const std::string kStandstill = ETALON_RENDERED "/standstill";

/** Where the flight is in motion, s; what follows holds one window of 10 keyframes and 0.7 s. */
constexpr const char* kInMotion = "1";

/** The whole text of a file; throws if it cannot be read. */
std::string readText(const std::string& path);
nlohmann::json readJson(const std::string& path);

/** A line of trajectory.tum. */
struct TumLine {
  std::string stamp;             ///< s, as written
  std::array<double, 7> pose{};  ///< x y z [m] qx qy qz qw
};
/** @throws std::runtime_error if a line has not 8 numbers */
std::vector<TumLine> readTum(const std::string& path);

/** Longest distance between positions of two trajectories' poses at the same place in the list, m;
 * throws if they differ in length or in a stamp. */
double largestDistance(const std::vector<TumLine>& a, const std::vector<TumLine>& b);

/** The first column of a recording's data.csv, as written, ns. */
std::vector<std::string> stampsOf(const std::string& csv);

/** The attempt of initialization.json with status success, null if there is none. */
nlohmann::json acceptedAttempt(const nlohmann::json& run);
/** Errors against ground truth after VI-BA of an accepted attempt; throws if there are none. */
nlohmann::json errorsAfterViBa(const nlohmann::json& attempt);

/**
 * A copy of a recording in a folder of its own, which a test may spoil. Images are symbolic links
 * to the original's.
 */
class RecordingCopy {
 public:
  explicit RecordingCopy(const std::string& original);
  const std::string& path() const { return folder_.path(); }
  /** Path of a file of the copy, `name` as "cam0/data.csv". */
  std::string file(const std::string& name) const;
  /** The file of the n-th line of a camera's data.csv, from 0. */
  std::string image(int camera, int index) const;
  /** Replaces the file, or the link to it. */
  void write(const std::string& path, const std::string& content) const;
  /** Adds `ns` to the first column of a data.csv; the images keep their names. */
  void shiftStamps(const std::string& name, long long ns) const;
  /** Replaces the first occurrence of `from`, which must be there. */
  void replace(const std::string& name, const std::string& from, const std::string& to) const;

 private:
  TemporaryFolder folder_;
};

}  // namespace etalon::testing
