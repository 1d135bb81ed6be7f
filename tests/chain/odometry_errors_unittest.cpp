// The odometry's errors on two rendered flights, against the bounds in odometry_errors.csv. A change
// that exceeds a bound has to raise it, and its commit has to say why.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>
#include <iostream>
#include <map>
#include <sstream>
#include <string>

#include "chain_files.h"

namespace etalon::testing {
namespace {

using nlohmann::json;

struct Bound {
  std::string recording, figure;
  double at_most = 0.0;
};

std::vector<Bound> bounds() {
  std::ifstream file(ETALON_ODOMETRY_ERRORS);
  std::vector<Bound> all;
  std::string line;
  std::getline(file, line);  // the header
  while (std::getline(file, line)) {
    std::istringstream cells(line);
    Bound bound;
    std::string number;
    std::getline(cells, bound.recording, ',');
    std::getline(cells, bound.figure, ',');
    std::getline(cells, number, ',');
    bound.at_most = std::stod(number);
    all.push_back(bound);
  }
  return all;
}

/** What the table bounds, of one run. */
std::map<std::string, double> figuresOf(const json& run) {
  std::map<std::string, double> figures;
  figures["initialized_at_s"] =
      1e-9 * static_cast<double>(run.at("initialized_at_ns").get<std::int64_t>() -
                                 run.at("first_image_ns").get<std::int64_t>());
  figures["refused_attempts"] = static_cast<double>(run.at("attempts").size()) - 1.0;
  figures["frames_not_located"] = run.at("statistics").at("frames_not_located").get<double>();
  // Two events, as images come and as a start is accepted, are those of a flight without faults.
  figures["further_events"] = static_cast<double>(run.at("events").size()) - 2.0;
  const auto add = [&](const std::string& name, const json& errors) {
    figures[name + "_position_m"] = errors.at("position_m").at("rmse").get<double>();
    figures[name + "_rotation_deg"] = errors.at("rotation_deg").at("rmse").get<double>();
  };
  add("causal", run.at("trajectory_errors"));
  add("smoothed", run.at("smoothed_trajectory_errors"));
  add("final", run.at("final_trajectory_errors"));
  return figures;
}

class OdometryErrors : public ::testing::TestWithParam<const char*> {};
INSTANTIATE_TEST_SUITE_P(Recordings, OdometryErrors,
                         ::testing::Values("ten_seconds_aggressive", "ten_seconds_gentle"),
                         [](const auto& test) { return std::string(test.param); });

TEST_P(OdometryErrors, AreWithinTheTable) {
  const TemporaryFolder folder;
  const std::string recording = ETALON_RENDERED "/" + std::string(GetParam());
  const CommandResult result =
      runEtalon({"replay", recording, "--final-ba", "--out", folder.path()});
  ASSERT_EQ(result.exit_code, 0) << result.out << result.err;
  const auto figures = figuresOf(readJson(folder.path() + "/initialization.json"));
  size_t bounded = 0;
  for (const Bound& bound : bounds()) {
    if (bound.recording != GetParam()) continue;
    ASSERT_EQ(figures.count(bound.figure), 1U) << "no figure is called " << bound.figure;
    EXPECT_LE(figures.at(bound.figure), bound.at_most) << bound.figure;
    ++bounded;
  }
  EXPECT_EQ(bounded, figures.size());  // every figure has its bound
  std::ostringstream measured;
  for (const auto& [figure, value] : figures)
    measured << GetParam() << "," << figure << "," << value << "\n";
  RecordProperty("measured", measured.str());
  if (HasFailure()) std::cout << "measured:\n" << measured.str();
}

}  // namespace
}  // namespace etalon::testing
