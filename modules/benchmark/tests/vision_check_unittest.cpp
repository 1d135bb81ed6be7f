#include "etalon/benchmark/vision_check.h"

#include <gtest/gtest.h>

#include "etalon/simulation/euroc_rig.h"
#include "etalon/simulation/imu_synthesis.h"
#include "etalon/simulation/profile_trajectory.h"
#include "etalon/simulation/track_synthesis.h"

namespace etalon {
namespace {

/** Five seconds of a brisk flight, seen to a tenth of a pixel. */
class VisionCheckTest : public ::testing::Test {
 protected:
  static constexpr double kSeconds = 5.0;

  VisionCheckTest() : flight_(options()) {
    tracks_.calibration = eurocCalibration();
    tracks_.imu = ImuBuffer(
        synthesizeImu(flight_, flight_.start(), flight_.end(), ImuSynthesisOptions::noiseFree())
            .samples);
    std::vector<TimeNs> stamps;
    for (int k = 0; k <= 4 * kSeconds; ++k) stamps.push_back(flight_.start() + durationNs(k / 4.0));
    tracks_.first_image = stamps.front();
    TrackSynthesisOptions synthesis;
    synthesis.sigma_px = 0.1;
    synthesis.max_tracks = 40;
    tracks_.frames = simulateTracks(posesAt(flight_, stamps), tracks_.calibration,
                                    scatterLandmarks(flight_, 600, 4), synthesis);
  }
  static ProfileOptions options() {
    ProfileOptions flight;
    flight.profile = MotionProfile::kAggressive;
    flight.seed = 4;
    flight.rest_s = 0.0;
    flight.take_off_s = 1.0;
    flight.duration_s = kSeconds + 1.0;
    return flight;
  }
  /** What is stamped t shows the body at t + shift_s. */
  GroundTruth truth(double shift_s, double from_s = 0.0) const {
    GroundTruth truth;
    for (int k = 0; k <= 100 * kSeconds; ++k) {
      const TimeNs t = flight_.start() + durationNs(0.01 * k);
      if (0.01 * k >= from_s)
        truth.states.emplace_back(t, flight_.at(t + durationNs(shift_s)).T_WB);
    }
    return truth;
  }

  ProfileTrajectory flight_;
  SequenceTracks tracks_;
};

TEST_F(VisionCheckTest, TellsALateGroundTruthFromARightOne) {
  const VisionCheck check = checkByVision(tracks_, truth(0.03), truth(0.0));
  EXPECT_EQ(check.windows, 3U);  // of 2.25 s, every second in five
  EXPECT_EQ(check.corrected_is_nearer, 3U);
  EXPECT_LT(check.corrected_m, 0.5 * check.recorded_m);
  EXPECT_LT(check.corrected_m, 5e-3);
}

TEST_F(VisionCheckTest, LikeIsNotNearer) {
  const VisionCheck check = checkByVision(tracks_, truth(0.0), truth(0.0));
  EXPECT_EQ(check.corrected_is_nearer, 0U);
  EXPECT_EQ(check.corrected_m, check.recorded_m);
}

TEST_F(VisionCheckTest, WindowsWithoutGroundTruthAreLeftOut) {
  EXPECT_EQ(checkByVision(tracks_, truth(0.0, 1.5), truth(0.0)).windows, 1U);
  EXPECT_EQ(checkByVision(tracks_, truth(0.0), {}).windows, 0U);
}

TEST_F(VisionCheckTest, TooShortHasNoWindows) {
  tracks_.frames.resize(8);
  EXPECT_EQ(checkByVision(tracks_, truth(0.0), truth(0.0)).windows, 0U);
  tracks_.frames.clear();
  EXPECT_EQ(checkByVision(tracks_, truth(0.0), truth(0.0)).windows, 0U);
}

}  // namespace
}  // namespace etalon
