// What is asked of an old keyframe, what is made of the answers, and what is not asked again.

#include "../src/fixed_lag/recall.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <map>

#include "../src/fixed_lag/sliding.h"
#include "point_scene.h"

namespace etalon::fixed_lag {
namespace {

using Eigen::Vector2d;

/** Answers with the pixels of the scene, as `change` leaves them. */
class Answers : public ViewMatcher {
 public:
  using Change = std::function<void(size_t, ViewMatch*)>;
  Answers(const PointScene& scene, const SE3& T_WB) : scene_(&scene), T_WB_(T_WB) {}

  bool keep(TimeNs) override { return true; }
  void dropAllBut(const std::vector<TimeNs>&) override {}
  std::vector<ViewMatch> find(TimeNs view, const std::vector<ViewQuery>& queries) override {
    views_.push_back(view);
    queries_ = queries;
    std::vector<ViewMatch> matches;
    for (const ViewQuery& query : queries) {
      ViewMatch match;
      match.found = match.has_right = true;
      for (size_t c = 0; c < 2; ++c) (c == 0 ? match.left : match.right) = pixelOf(query.id, c);
      if (change_) change_(matches.size(), &match);
      matches.push_back(match);
    }
    return matches;
  }
  Vector2d pixelOf(LandmarkId id, size_t camera) const {
    const CameraCalibration& c = scene_->calibration.cameras[camera];
    return *c.model.project((T_WB_ * c.T_BC).inverse() * scene_->points[id % 1000]);
  }

  std::vector<TimeNs> views_;
  std::vector<ViewQuery> queries_;
  Change change_;

 private:
  const PointScene* scene_;
  SE3 T_WB_;
};

/** An old keyframe at the origin whose landmarks have ended; three newer frames see the same points
 * under other ids, from a little aside. */
struct Returned : PointScene {
  Tracks tracks{calibration, {}};
  WindowSolver solver{{}};
  TrackedFrame newest;

  Returned() : PointScene(40) {
    SlidingOptions sliding{3, 0, {}};
    window.states.back().is_view = true;
    window.states.back().now.v_WB = {0.0, 0.4, 0.2};  // as the frames move: all residuals are zero
    window.states.back().linearization = window.states.back().now;
    tracks.createLandmarks(measured(seeFromNewest()), &window);
    for (int k = 1; k <= 5; ++k) {
      append(movedTo(0.0, 0.02 * k, 0.01 * k));
      if (k < 3) continue;
      newest = seeFromNewest();
      for (Observation& o : newest.observations) o.id += 1000;
      tracks.associate(measured(newest), wellKnown(), &window);
      if (k == 3) {
        window.states.back().keyframe = true;
        tracks.createLandmarks(measured(newest), &window);
      }
      slide(sliding, &window);
    }
    solver.solve(&window, SolverOptions().iterations, false);
  }
  int recall(Answers* answers, const MapOptions& options = {}) {
    const Recall recall(calibration, options, kSigmaPx);
    return static_cast<int>(recall.recall(newest, answers, solver, &window).size());
  }
  size_t foundIn(int serial) const {
    size_t count = 0;
    for (const auto& [id, landmark] : window.landmarks)
      for (const LandmarkObservation& o : landmark.observations) count += o.serial == serial;
    return count;
  }
};

TEST(Recall, LandmarksAreFoundWhereTheOldKeyframeShowsThem) {
  Returned scene;
  ASSERT_TRUE(scene.window.states[0].retained);
  ASSERT_EQ(scene.window.landmarks.size(), 40U);
  Answers answers(scene, SE3());
  const int found = scene.recall(&answers);
  EXPECT_GE(found, 35);  // a few are too near to the edge
  EXPECT_EQ(found, static_cast<int>(scene.foundIn(0)));
  EXPECT_EQ(answers.views_, (std::vector<TimeNs>{0}));
  for (const ViewQuery& query : answers.queries_) {
    EXPECT_LT((query.left - answers.pixelOf(query.id, 0)).norm(), 1e-3);
    EXPECT_LT((query.right - answers.pixelOf(query.id, 1)).norm(), 1e-3);
    EXPECT_GT(query.reach_px, 2.0);
    const auto seen =
        std::find_if(scene.newest.observations.begin(), scene.newest.observations.end(),
                     [&](const Observation& o) { return o.id == query.id; });
    ASSERT_NE(seen, scene.newest.observations.end());
    EXPECT_EQ(query.pixel, seen->left);
  }
  for (const auto& [id, landmark] : scene.window.landmarks) {
    const auto& all = landmark.observations;
    for (size_t i = 1; i < all.size(); ++i) EXPECT_LT(all[i - 1].serial, all[i].serial) << id;
    if (all.front().serial != 0) continue;
    EXPECT_EQ(all.front().state, 0);
    EXPECT_TRUE(all.front().has_left && all.front().has_right);
  }
}

TEST(Recall, TheReachFollowsTheNoiseThatTheResidualsShow) {
  std::map<LandmarkId, double> reach;
  for (const double variance : {1.0, 9.0}) {
    Returned scene;
    scene.window.pixel_variance = variance;
    Answers answers(scene, SE3());
    scene.recall(&answers);
    ASSERT_GT(answers.queries_.size(), 30U);
    for (const ViewQuery& query : answers.queries_) {
      if (variance == 1.0) {
        reach[query.id] = query.reach_px;
        continue;
      }
      // Three standard deviations of 4 * 0.35 px in two coordinates: the noise has grown by a
      // variance of 8 of these; what the poses are off by is the same.
      const double more = std::pow(query.reach_px - 2.0, 2) - std::pow(reach.at(query.id) - 2.0, 2);
      EXPECT_NEAR(more, 8.0 * 9.0 * 2.0 * 1.4 * 1.4, 3.0);
    }
  }
}

TEST(Recall, WhatWasSoughtIsNotSoughtAgain) {
  Returned scene;
  Answers answers(scene, SE3());
  answers.change_ = [](size_t i, ViewMatch* match) { match->found = i >= 3; };
  const int found = scene.recall(&answers);
  EXPECT_EQ(found, static_cast<int>(answers.queries_.size()) - 3);
  // Neither those that were found nor the three that were not.
  EXPECT_EQ(scene.recall(&answers), 0);
  EXPECT_EQ(answers.views_.size(), 1U);
}

/** The old image errs there as it did when it was asked before, about another landmark. */
TEST(Recall, AnotherLandmarkAtTheSamePointOfAViewCountsForLess) {
  Returned scene;
  Answers answers(scene, SE3());
  answers.change_ = [](size_t i, ViewMatch* match) { match->found = i >= 10; };
  scene.recall(&answers);
  std::map<LandmarkId, Eigen::Matrix2d> first;
  for (auto& [id, landmark] : scene.window.landmarks) {
    landmark.sought.clear();
    if (landmark.observations.front().serial != 0) continue;
    first[id] = landmark.observations.front().measurements[1].sqrt_information;
    landmark.observations.erase(landmark.observations.begin());
  }
  ASSERT_GE(first.size(), 25U);
  answers.change_ = nullptr;
  EXPECT_EQ(scene.recall(&answers), static_cast<int>(first.size()) + 10);
  const Eigen::Matrix2d& known = first.begin()->second;
  for (const ViewQuery& query : answers.queries_) {
    const LandmarkObservation& o = scene.window.landmarks.at(query.id).observations.front();
    ASSERT_EQ(o.serial, 0);
    const Eigen::Matrix2d& now = o.measurements[1].sqrt_information;
    if (first.count(query.id))
      EXPECT_LT((std::sqrt(2.0) * now - first[query.id]).norm(), 1e-9 * now.norm());
    else
      EXPECT_NEAR(now.norm() / known.norm(), 1.0, 0.3);  // as the camera's scale is there
  }
}

TEST(Recall, AViewInWhichTooFewAreFoundIsAskedAgain) {
  Returned scene;
  Answers answers(scene, SE3());
  answers.change_ = [](size_t i, ViewMatch* match) { match->found = i < 9; };
  EXPECT_EQ(scene.recall(&answers), 0);
  EXPECT_EQ(scene.foundIn(0), 0U);
  const size_t asked = answers.queries_.size();
  EXPECT_EQ(scene.recall(&answers), 0);
  EXPECT_EQ(answers.views_.size(), 2U);
  EXPECT_EQ(answers.queries_.size(), asked);
}

TEST(Recall, FewLandmarksAreNotBelievedWhereTheyMightBeFarAway) {
  Returned scene;
  Answers answers(scene, SE3());
  for (const size_t there : {12, 19, 20}) {  // more than min_landmarks
    answers.change_ = [there](size_t i, ViewMatch* match) { match->found = i < there; };
    EXPECT_EQ(scene.recall(&answers), there < 20 ? 0 : 20);
    EXPECT_GT(answers.queries_.front().reach_px, 40.0);
  }
}

TEST(Recall, WrongMatchesAreLeftOut) {
  Returned scene;
  Answers answers(scene, SE3());
  answers.change_ = [](size_t i, ViewMatch* match) {
    if (i % 5 == 0) match->left += Vector2d(15.0, -12.0);
  };
  const int found = scene.recall(&answers);
  EXPECT_GE(found, 25);
  for (size_t i = 0; i < answers.queries_.size(); ++i) {
    const Landmark& landmark = scene.window.landmarks.at(answers.queries_[i].id);
    EXPECT_EQ(landmark.observations.front().serial == 0, i % 5 != 0) << i;
  }
}

TEST(Recall, NoMoreLandmarksAreSoughtThanAreWantedAndTheyAreSpread) {
  Returned scene;
  Answers answers(scene, SE3());
  MapOptions options;
  options.landmarks = 12;
  scene.recall(&answers, options);
  ASSERT_EQ(answers.queries_.size(), 12U);
  EXPECT_LT(answers.queries_.front().id, 1005);
  EXPECT_GT(answers.queries_.back().id, 1030);
  for (size_t i = 1; i < 12; ++i) EXPECT_LE(answers.queries_[i].id - answers.queries_[i - 1].id, 6);
}

TEST(Recall, AViewThatSeesTooLittleIsNotAskedNorAreOthersThanRetainedOnes) {
  Returned scene;
  Answers answers(scene, SE3());
  MapOptions options;
  options.min_landmarks = 41;
  EXPECT_EQ(scene.recall(&answers, options), 0);
  scene.window.states[0].retained = false;
  EXPECT_EQ(scene.recall(&answers), 0);
  EXPECT_TRUE(answers.views_.empty());
}

TEST(Recall, LandmarksThatAreHardlyKnownAreNotSought) {
  Returned scene;
  Answers answers(scene, SE3());
  for (auto& [id, landmark] : scene.window.landmarks) {
    if (id % 4 == 1) landmark.observations.erase(landmark.observations.begin());  // two are left
    if (id % 4 == 2) landmark.in_host.parameters.z() = 1e-4;                      // 10 km away
    if (id % 4 == 3) landmark.observations.pop_back();  // not in the newest
  }
  MapOptions options;
  options.min_landmarks = 5;
  scene.recall(&answers, options);
  EXPECT_GE(answers.queries_.size(), 8U);
  for (const ViewQuery& query : answers.queries_) EXPECT_EQ(query.id % 4, 0);
}

}  // namespace
}  // namespace etalon::fixed_lag
