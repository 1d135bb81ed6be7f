#include "etalon/pipeline/missing_input.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>

#include "etalon/simulation/euroc_rig.h"

namespace etalon {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;

using Said = std::vector<std::string>;

TimeNs stamp(int frame) { return durationNs(1.0 + 0.05 * frame); }

/** 40 landmarks that the cameras see. */
TrackedFrame seen(bool left, bool right) {
  TrackedFrame frame;
  for (LandmarkId id = 0; id < 40; ++id) {
    Observation o;
    o.id = id;
    o.has_right = right;
    if (left) frame.observations.push_back(o);
    if (left || !right) continue;
    RightObservation alone;
    alone.id = id;
    frame.right_only.push_back(alone);
  }
  return frame;
}

/** 300 frames at 20 Hz, and at the end finish(); `lacks` changes a frame, or says that it is lost.
 */
Said fly(const std::function<bool(int, TrackedFrame*, MissingInput::Frame*)>& lacks) {
  MissingInput missing(eurocCalibration());
  Said all;
  const auto add = [&all](const Said& said) { all.insert(all.end(), said.begin(), said.end()); };
  for (int k = 0; k < 300; ++k) {
    MissingInput::Frame frame;
    frame.t = stamp(k);
    TrackedFrame tracked = seen(true, true);
    frame.tracked = &tracked;
    if (!lacks(k, &tracked, &frame)) continue;
    tracked.t = frame.t;
    add(missing.frame(frame));
  }
  add(missing.finish());
  return all;
}

TEST(MissingInput, AYearBetweenTwoImagesIsNoNumberOfImages) {
  const Said said = fly([](int k, TrackedFrame* /*tracked*/, MissingInput::Frame* frame) {
    if (k >= 150) frame->t += durationNs(365.0 * 86'400.0);
    return true;
  });
  ASSERT_FALSE(said.empty());
  EXPECT_THAT(said.front(), ::testing::StartsWith("images are missing: "));
  for (const std::string& sentence : said) EXPECT_THAT(sentence, Not(::testing::HasSubstr("-")));
}

TEST(MissingInput, AGapIsLongAgainstTheStepsOfTheImu) {
  const auto said = [](double rate_hz, double step_s) {
    StereoInertialCalibration calibration = eurocCalibration();
    calibration.imu.rate_hz = rate_hz;
    MissingInput missing(calibration);
    missing.sample(durationNs(1.0));
    missing.sample(durationNs(1.0 + step_s));
    MissingInput::Frame frame;
    frame.t = durationNs(1.0 + step_s);
    return missing.frame(frame);
  };
  EXPECT_THAT(said(200.0, 0.029), IsEmpty());
  EXPECT_THAT(said(200.0, 0.04), ElementsAre("no IMU sample for 0.04 s: images bridge the gap"));
  EXPECT_THAT(said(25.0, 0.04), IsEmpty());  // as it always is
  EXPECT_THAT(said(25.0, 0.08), IsEmpty());  // one is missing
  EXPECT_THAT(said(25.0, 0.12), ElementsAre("no IMU sample for 0.12 s: images bridge the gap"));
  EXPECT_THAT(said(0.0, 0.04).size(), 1U);  // of an unknown rate
}

TEST(MissingInput, AnImuAtTheEndOfItsRangeIsSaidOnceAndCounted) {
  MissingInput missing(eurocCalibration());
  Said all;
  for (int k = 0; k < 60; ++k) {
    missing.sample(stamp(k), k >= 10 && k < 15);
    MissingInput::Frame frame;
    frame.t = stamp(k);
    const TrackedFrame tracked = seen(true, true);
    frame.tracked = &tracked;
    for (const std::string& said : missing.frame(frame)) all.push_back(said);
  }
  // The samples are 50 ms apart here, which is a gap, too.
  EXPECT_EQ(
      std::count(all.begin(), all.end(), "the IMU is at the end of its range: it counts for less"),
      1);
  EXPECT_EQ(std::count(all.begin(), all.end(), "5 IMU samples were at the end of the range"), 1);
}

TEST(MissingInput, NothingIsSaidWhereNothingIsMissing) {
  EXPECT_THAT(fly([](int, TrackedFrame*, MissingInput::Frame*) { return true; }), IsEmpty());
  // One image in a while is not worth a word.
  EXPECT_THAT(fly([](int k, TrackedFrame*, MissingInput::Frame*) { return k % 50 != 40; }),
              IsEmpty());
}

TEST(MissingInput, ACoveredLensIsSaidOnceAndThatItIsOver) {
  for (const bool left : {true, false}) {
    const std::string name = left ? "left" : "right";
    const auto covered = [left](int from, int to) {
      return fly([=](int k, TrackedFrame* tracked, MissingInput::Frame*) {
        if (k >= from && k < to) *tracked = seen(!left, left);
        return true;
      });
    };
    EXPECT_THAT(covered(100, 110),
                ElementsAre("the " + name + " camera sees nothing: the other one carries on",
                            "the " + name + " camera sees again; it saw nothing for 0.50 s"));
    EXPECT_THAT(covered(100, 300),
                ElementsAre("the " + name + " camera sees nothing: the other one carries on",
                            "the " + name + " camera saw nothing for 10.00 s"));
  }
  // Both: no image locates the platform, which the state says.
  EXPECT_THAT(fly([](int k, TrackedFrame* tracked, MissingInput::Frame*) {
                if (k >= 100 && k < 120) *tracked = TrackedFrame();
                return true;
              }),
              IsEmpty());
}

TEST(MissingInput, ImagesThatAreMissingAreSaidOnce) {
  EXPECT_THAT(
      fly([](int k, TrackedFrame*, MissingInput::Frame*) { return k % 2 == 0; }),
      ElementsAre("images are missing: 10 of the last 20", "149 of 298 images were missing"));
  // So are those that repeat the one before.
  EXPECT_THAT(
      fly([](int k, TrackedFrame*, MissingInput::Frame* frame) {
        if (k % 2 == 1) frame->tracked = nullptr;
        return true;
      }),
      ElementsAre("images are missing: 10 of the last 20", "149 of 298 images were missing"));
  EXPECT_THAT(fly([](int k, TrackedFrame*, MissingInput::Frame*) { return k < 100 || k >= 104; }),
              ElementsAre("images are missing: 4 of the last 20",
                          "all images come again; 4 of 120 were missing"));
  // Where the state says it, or the clock jumped, it is not said twice.
  EXPECT_THAT(fly([](int k, TrackedFrame*, MissingInput::Frame* frame) {
                if (k == 120) frame->before = PipelineState::kDeadReckoning;
                return k < 100 || k >= 120;
              }),
              IsEmpty());
}

TEST(MissingInput, BeforeTheStartAPoseThatIsAGuessIsSaid) {
  EXPECT_THAT(fly([](int k, TrackedFrame*, MissingInput::Frame* frame) {
                frame->state = PipelineState::kVisual;
                frame->located = k < 100 || k >= 110;
                return true;
              }),
              ElementsAre("no image locates the platform: the pose is a guess",
                          "10 images did not locate the platform"));
}

/** Samples at 200 Hz but for those that are lost, frames at 20 Hz. */
Said flyWithImu(const std::function<bool(double)>& lost) {
  MissingInput missing(eurocCalibration());
  Said all;
  for (int k = 0; k < 2000; ++k) {
    const double t = 0.005 * k;
    if (!lost(t)) missing.sample(durationNs(1.0 + t));
    if (k % 10 != 9) continue;
    MissingInput::Frame frame;
    frame.t = durationNs(1.0 + t);
    const Said said = missing.frame(frame);
    all.insert(all.end(), said.begin(), said.end());
  }
  const Said said = missing.finish();
  all.insert(all.end(), said.begin(), said.end());
  return all;
}

TEST(MissingInput, AGapInTheImuIsSaidWithItsLength) {
  EXPECT_THAT(flyWithImu([](double t) { return t > 3.0 && t < 3.099; }),
              ElementsAre("no IMU sample for 0.10 s: images bridge the gap"));
  // 40 gaps in ten seconds.
  const Said many = flyWithImu([](double t) { return std::fmod(t, 0.25) > 0.15; });
  ASSERT_EQ(many.size(), 2U);
  EXPECT_THAT(many[1], ::testing::StartsWith("the IMU had 39 gaps, 4.0"));
}

TEST(MissingInput, ImagesWithoutImuAreSaidOnce) {
  EXPECT_THAT(fly([](int k, TrackedFrame*, MissingInput::Frame* frame) {
                frame->imu = k < 100 || k >= 140;
                return true;
              }),
              ElementsAre("no IMU reaches the images: they carry on alone",
                          "the IMU is back after 40 images"));
}

TEST(MissingInput, AJumpOfTheClockIsNoGap) {
  MissingInput missing(eurocCalibration());
  missing.sample(durationNs(1.0));
  missing.frame({durationNs(1.0)});
  EXPECT_EQ(missing.clockJumped(durationNs(1.0), durationNs(6.0)),
            "the IMU's stamps jump by 5.00 s: nothing is integrated across it");
  missing.sample(durationNs(6.0));
  MissingInput::Frame frame;
  frame.t = durationNs(6.0);
  frame.imu = false;
  EXPECT_THAT(missing.frame(frame), IsEmpty());
}

}  // namespace
}  // namespace etalon
