#include "etalon/report/ground_truth_report.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>
#include <sstream>

#include "etalon/core/angles.h"

namespace etalon {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

constexpr double kInfinity = std::numeric_limits<double>::infinity();

/** Late positions, a turned body, a tilted world and a gap. */
GroundTruthJudgement judgement(const std::string& name = "V9_01_<odd>") {
  GroundTruthJudgement one;
  one.name = name;
  GroundTruthSmoothing& f = one.found;
  f.offset.position_shift_s = {-0.0297, 0.0041};
  f.plain_offset.position_shift_s = {-0.0192, 0.002};
  f.offset.rotation_shift_s = {1e-5, 2e-5};
  f.offset.turn_rad.value = {0.0, 0.0, radians(-0.84)};
  f.offset.turn_rad.sigma.setConstant(radians(0.11));
  f.plain_offset.turn_rad.value = {0.0, 0.0, radians(-0.25)};
  f.position_bandwidth_hz = {0.75, 0.13};
  f.rotation_bandwidth_hz = {kInfinity, 0.0};
  f.tilt_rad = {radians(0.55), radians(0.04)};
  f.gaps = {{1000, 2.5}};
  for (int k = 0; k < 20; ++k)
    f.corrected.states.emplace_back(50'000'000 * k, SE3(Eigen::Matrix3d::Identity(),
                                                        Eigen::Vector3d(0.1 * k, 0.01 * k * k, 1)));
  one.vision = {5, 0.0023, 0.00062, 4};
  return one;
}

TEST(GroundTruthReport, SaysWhatIsSignificant) {
  const std::string words = inWords(judgement().found);
  EXPECT_THAT(words, HasSubstr("positions 29.7 +- 4.1 ms late below 0.8 Hz (as one number 19.2"));
  EXPECT_THAT(words, HasSubstr("turned -0.84 +- 0.11 deg about z"));
  EXPECT_THAT(words, HasSubstr("tilted 0.55 +- 0.04 deg"));
  EXPECT_THAT(words, HasSubstr("1 gaps"));
  EXPECT_THAT(words, Not(HasSubstr("rotations")));
  EXPECT_THAT(words, Not(HasSubstr("about x")));
  EXPECT_EQ(inWords({}), "nothing significant");
}

TEST(GroundTruthReport, SaysWhereTheImagesDoNotSupportTheCorrection) {
  GroundTruthJudgement one = judgement();
  EXPECT_THAT(groundTruthPage({one}), Not(HasSubstr("keep the recorded ones")));
  one.vision = {5, 0.0006, 0.0063, 0};
  EXPECT_THAT(groundTruthPage({one}), HasSubstr("keep the recorded ones"));
}

TEST(GroundTruthReport, PageIsNoWiderThanAScreen) {
  GroundTruthJudgement wide = judgement("a_recording_with_a_rather_long_name");
  wide.found.offset.rotation_shift_s = {-0.11234, 0.01234};
  wide.found.offset.lever_m.value = {-1.234, 0.567, -0.891};
  const std::string page = groundTruthPage({judgement(), wide});
  std::istringstream lines(page);
  for (std::string line; std::getline(lines, line);) EXPECT_LE(line.size(), 100U) << line;
  EXPECT_THAT(page, HasSubstr("-29.7 +- 4.1"));
  EXPECT_THAT(page, HasSubstr("0.62 mm from"));
}

TEST(GroundTruthReport, ImagesAreNamedWhereTheyWereLookedAt) {
  GroundTruthJudgement blind = judgement();
  blind.vision = {};
  EXPECT_THAT(groundTruthPage({blind}), Not(HasSubstr("images")));
  EXPECT_THAT(groundTruthReportHtml(blind, {}), Not(HasSubstr("stereo odometry")));
  EXPECT_THAT(groundTruthReportHtml(judgement(), {}), HasSubstr("nearer in 4"));
}

TEST(GroundTruthReport, IsOnePageWithItsPlot) {
  const GroundTruthJudgement one = judgement();
  const std::string html = groundTruthReportHtml(one, one.found.corrected);
  EXPECT_THAT(html, HasSubstr("<svg"));
  EXPECT_THAT(html, HasSubstr("</svg>"));
  EXPECT_THAT(html, HasSubstr("Position error"));
  EXPECT_THAT(html, HasSubstr(">corrected<"));
  EXPECT_THAT(html, HasSubstr(">recorded<"));
  EXPECT_THAT(html, HasSubstr("V9_01_&lt;odd&gt;"));
  EXPECT_THAT(html, Not(HasSubstr("<odd>")));
  EXPECT_THAT(html, HasSubstr("gap after 1000"));
  EXPECT_THAT(html, HasSubstr("The same as one number for all motion"));
  for (const char* other : {"<link", "<script", "src=", "href="})
    EXPECT_THAT(html, Not(HasSubstr(other)));
}

}  // namespace
}  // namespace etalon
