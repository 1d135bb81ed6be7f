#include "etalon/simulation/track_synthesis.h"

#include <gtest/gtest.h>

#include <cmath>
#include <set>

#include "etalon/simulation/euroc_rig.h"
#include "etalon/simulation/profile_trajectory.h"

namespace etalon {
namespace {

class TrackSynthesis : public ::testing::Test {
 protected:
  TrackSynthesis() : trajectory_(options()), rig_(eurocCalibration()) {
    landmarks_ = scatterLandmarks(trajectory_, 3000, 7);
    std::vector<TimeNs> stamps;
    for (int k = 0; k < 40; ++k) stamps.push_back(stampAtRate(trajectory_.start(), 20.0, 100 + k));
    poses_ = posesAt(trajectory_, stamps);
  }
  static ProfileOptions options() {
    ProfileOptions o;
    o.duration_s = 10.0;
    return o;
  }
  Eigen::Vector2d project(size_t camera, size_t frame, LandmarkId id) const {
    const SE3 T_CW = (poses_[frame].T_WB * rig_.cameras[camera].T_BC).inverse();
    return rig_.cameras[camera].model.project(T_CW * landmarks_[id]).value();
  }

  ProfileTrajectory trajectory_;
  StereoInertialCalibration rig_;
  std::vector<Eigen::Vector3d> landmarks_;
  Trajectory poses_;
};

TEST_F(TrackSynthesis, NoiseFreeTracksAreProjections) {
  TrackSynthesisOptions options;
  options.sigma_px = 0.0;
  const std::vector<TrackedFrame> frames = simulateTracks(poses_, rig_, landmarks_, options);
  ASSERT_EQ(frames.size(), poses_.size());
  for (size_t k = 0; k < frames.size(); ++k) {
    EXPECT_EQ(frames[k].t, poses_[k].t);
    EXPECT_EQ(frames[k].observations.size(), 200u);
    for (const Observation& o : frames[k].observations) {
      EXPECT_EQ(o.left, project(0, k, o.id));
      if (o.has_right) {
        EXPECT_EQ(o.right, project(1, k, o.id));
      }
    }
  }
}

TEST_F(TrackSynthesis, NoiseAndOutliersAreWhatWasAskedFor) {
  TrackSynthesisOptions options;
  options.sigma_px = 0.7;
  options.outlier_ratio = 0.1;
  double squares = 0.0;
  int coordinates = 0, outliers = 0, all = 0;
  const auto count = [&](const Eigen::Vector2d& error) {
    ++all;
    if (error.norm() > 4.0) {  // 5.7 sigma; outliers are off by 5 to 50 px
      ++outliers;
      EXPECT_LT(error.norm(), 50.0 + 4.0);
      return;
    }
    squares += error.squaredNorm();
    coordinates += 2;
  };
  const std::vector<TrackedFrame> frames = simulateTracks(poses_, rig_, landmarks_, options);
  for (size_t k = 0; k < frames.size(); ++k)
    for (const Observation& o : frames[k].observations) {
      count(o.left - project(0, k, o.id));
      if (o.has_right) count(o.right - project(1, k, o.id));
    }
  // About 25,000 coordinates: 0.5 %; 14,000 pixels: 0.3 %; five of those. Of the outliers some 2 %
  // are within 6 px, and their noise may hide them below 4.
  EXPECT_NEAR(std::sqrt(squares / coordinates), 0.7, 0.7 * 0.03);
  EXPECT_NEAR(static_cast<double>(outliers) / all, 0.1, 0.017);
}

TEST_F(TrackSynthesis, TracksLast) {
  const auto frames = simulateTracks(poses_, rig_, landmarks_);
  std::set<LandmarkId> first;
  for (const auto& o : frames[0].observations) first.insert(o.id);
  int kept = 0;
  for (const auto& o : frames[5].observations) kept += first.count(o.id);
  EXPECT_GT(kept, 120);  // a quarter second later, most landmarks are still in view
}

}  // namespace
}  // namespace etalon
