#include "etalon/simulation/track_synthesis.h"

#include <gtest/gtest.h>

#include <cmath>
#include <set>

#include "etalon/simulation/euroc_rig.h"
#include "etalon/simulation/profile_trajectory.h"

namespace etalon {
namespace {

class TrackSynthesis : public testing::Test {
 protected:
  TrackSynthesis() : trajectory_(options()), rig_(eurocCalibration()) {
    landmarks_ = scatterLandmarks(trajectory_, 3000, 7);
    for (int k = 0; k < 40; ++k) stamps_.push_back(stampAtRate(trajectory_.start(), 20.0, 100 + k));
  }
  static ProfileOptions options() {
    ProfileOptions o;
    o.duration_s = 10.0;
    return o;
  }
  Eigen::Vector2d project(size_t camera, const SyntheticFrame& frame, std::uint64_t id) const {
    const SE3 T_CW = (frame.T_WB * rig_.cameras[camera].T_BC).inverse();
    return rig_.cameras[camera].model.project(T_CW * landmarks_[id]).value();
  }

  ProfileTrajectory trajectory_;
  StereoInertialCalibration rig_;
  std::vector<Eigen::Vector3d> landmarks_;
  std::vector<TimeNs> stamps_;
};

TEST_F(TrackSynthesis, NoiseFreeTracksAreProjections) {
  TrackSynthesisOptions options;
  options.sigma_px = 0.0;
  for (const SyntheticFrame& frame :
       simulateTracks(trajectory_, rig_, stamps_, landmarks_, options)) {
    EXPECT_EQ(frame.observations.size(), 200u);
    for (const SyntheticObservation& o : frame.observations) {
      EXPECT_EQ(o.left, project(0, frame, o.id));
      if (o.has_right) {
        EXPECT_EQ(o.right, project(1, frame, o.id));
      }
      EXPECT_FALSE(o.is_outlier);
    }
  }
}

TEST_F(TrackSynthesis, NoiseAndOutliersAreWhatWasAskedFor) {
  TrackSynthesisOptions options;
  options.sigma_px = 0.7;
  options.outlier_ratio = 0.1;
  double squares = 0.0;
  int coordinates = 0, outliers = 0, all = 0;
  for (const SyntheticFrame& frame :
       simulateTracks(trajectory_, rig_, stamps_, landmarks_, options)) {
    for (const SyntheticObservation& o : frame.observations) {
      ++all;
      if (o.is_outlier) {
        ++outliers;
        continue;
      }
      squares += (o.left - project(0, frame, o.id)).squaredNorm();
      coordinates += 2;
    }
  }
  // About 14,000 coordinates: 0.6 %; 8,000 observations: 0.3 %; five of those.
  EXPECT_NEAR(std::sqrt(squares / coordinates), 0.7, 0.7 * 0.03);
  EXPECT_NEAR(static_cast<double>(outliers) / all, 0.1, 0.017);
}

TEST_F(TrackSynthesis, TracksLast) {
  const auto frames = simulateTracks(trajectory_, rig_, stamps_, landmarks_);
  std::set<std::uint64_t> first, later;
  for (const auto& o : frames[0].observations) first.insert(o.id);
  int kept = 0;
  for (const auto& o : frames[5].observations) kept += static_cast<int>(first.count(o.id));
  EXPECT_GT(kept, 120);  // a quarter second later, most landmarks are still in view
}

}  // namespace
}  // namespace etalon
