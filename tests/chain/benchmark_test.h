#pragma once

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <sstream>
#include <stdexcept>
#include <string>
#include <vector>

#include "chain_files.h"

namespace etalon::testing {

/** The tracks of all tests that do not spoil them. */
inline const std::string kTracks = ETALON_RENDERED "/tracks";

/** Runs benchmarks of the two rendered recordings in a folder of its own. */
class BenchmarkTest : public ::testing::Test {
 protected:
  std::string out(const std::string& name) const { return folder_.path() + "/" + name; }

  /** Short windows, so that the short flights have several. */
  std::vector<std::string> arguments(const std::string& name,
                                     const std::vector<std::string>& more = {},
                                     const std::string& tracks = kTracks) const {
    std::vector<std::string> all = {"bench", kFlight, kStandstill, "--out", out(name)};
    for (const std::vector<std::string>& option :
         {std::vector<std::string>{"--initializers", "eta,orbslam3_inertial_only"},
          {"--every", "0.5"},
          {"--keyframes", "4,5"},
          {"--rate", "4"},
          {"--tracks", tracks}})
      all.insert(all.end(), option.begin(), option.end());
    all.insert(all.end(), more.begin(), more.end());
    return all;
  }

  TemporaryFolder folder_;
};

/** A CSV file without its columns of run times, which are the last ones of every line. */
inline std::string withoutTimes(const std::string& path) {
  std::istringstream text(readText(path));
  std::string header, result;
  std::getline(text, header);
  const size_t times = header.find(",runtime_ms");
  if (times == std::string::npos) throw std::runtime_error(path + ": no column runtime_ms");
  size_t columns = 0;
  for (const char c : header.substr(times)) columns += c == ',' ? 1 : 0;
  result = header.substr(0, times) + "\n";
  for (std::string line; std::getline(text, line);) {
    for (size_t i = 0; i < columns; ++i) line.erase(line.rfind(','));
    result += line + "\n";
  }
  return result;
}

inline void expectSameResults(const std::string& a, const std::string& b) {
  for (const char* file : {"/windows.csv", "/summary.csv"})
    EXPECT_EQ(withoutTimes(a + file), withoutTimes(b + file)) << a << " and " << b << file;
}

}  // namespace etalon::testing
