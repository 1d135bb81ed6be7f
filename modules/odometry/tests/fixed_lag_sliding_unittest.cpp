// What leaves a window of the fixed-lag odometry, and what stays of it.

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

#include "../src/fixed_lag/sliding.h"
#include "../src/fixed_lag/window_solver.h"
#include "etalon/core/so3.h"
#include "point_scene.h"

namespace etalon::fixed_lag {
namespace {

using Eigen::Vector3d;

/** A window that moves along y and sees the same points from everywhere. */
struct Slider : PointScene {
  Tracks tracks;
  explicit Slider(size_t count = 30) : PointScene(count), tracks(calibration, {}) {
    NavState& start = window.states.back().now;
    start.v_WB.y() = 1.0;  // 5 cm a step
    window.states.back().linearization = start;
    tracks.createLandmarks(measured(seeFromNewest()), &window);
    window.states.back().is_view = true;
  }
  /** One more state, `step` m on. */
  void add(bool keyframe, double step = 0.05, bool sees = true) {
    append(movedTo(0.0, window.states.back().now.T_WB.t.y() + step, 0.0));
    if (sees) {
      const MeasuredFrame frame = measured(seeFromNewest());
      tracks.associate(frame, wellKnown(), &window);
      if (keyframe) tracks.createLandmarks(frame, &window);
    }
    window.states.back().keyframe = window.states.back().is_view = keyframe;
  }
  std::vector<int> serials() const {
    std::vector<int> serials;
    for (const WindowState& state : window.states) serials.push_back(state.serial);
    return serials;
  }
};

TEST(Slide, DoesNothingWhileThereIsRoom) {
  Slider slider;
  slider.add(false);
  slider.add(false);
  slide({3, 7, {}}, &slider.window);
  EXPECT_EQ(slider.serials(), (std::vector<int>{0, 1, 2}));
  EXPECT_EQ(slider.window.prior.unknowns(), 15);
  EXPECT_FALSE(slider.window.states[1].fixed);
}

TEST(Slide, AKeyframeStaysWithItsPoseAndOtherFramesLeaveWithTheirPixels) {
  Slider slider;
  for (int k = 1; k <= 3; ++k) slider.add(k == 2);
  slide({3, 7, {}}, &slider.window);  // 0 is a keyframe
  EXPECT_EQ(slider.serials(), (std::vector<int>{0, 1, 2, 3}));
  EXPECT_FALSE(slider.window.states[0].full);
  EXPECT_TRUE(slider.window.states[1].full);
  EXPECT_EQ(slider.window.firstFull(), 1U);
  EXPECT_EQ(slider.window.unknowns(), 6 + 3 * 15);
  EXPECT_EQ(slider.window.prior.unknowns(), 6 + 15);  // the next state's, too
  EXPECT_TRUE(slider.window.states[1].fixed);
  EXPECT_FALSE(slider.window.states[2].fixed);
  slider.add(false);
  slide({3, 7, {}}, &slider.window);  // 1 is none
  EXPECT_EQ(slider.serials(), (std::vector<int>{0, 2, 3, 4}));
  for (const auto& [id, landmark] : slider.window.landmarks) {
    EXPECT_EQ(landmark.observations.size(), 4U) << id;
    for (const LandmarkObservation& o : landmark.observations) {
      EXPECT_NE(o.serial, 1);
      EXPECT_EQ(slider.window.states[o.state].serial, o.serial);
    }
  }
}

TEST(Slide, LandmarksThatTheNewestStatesSawStayAndOthersLeave) {
  Slider slider;
  slider.add(false);
  for (int k = 2; k <= 3; ++k) slider.add(false, 0.05, false);  // nothing is seen
  const size_t count = slider.window.landmarks.size();
  ASSERT_EQ(count, 30U);
  slide({3, 7, {}}, &slider.window);
  // State 1, which saw them, is one of the newest: they stay.
  EXPECT_EQ(slider.window.landmarks.size(), count);
  Slider part;
  for (int k = 1; k <= 3; ++k) {
    part.add(false, 0.05, false);
    TrackedFrame frame = part.seeFromNewest();
    frame.observations.resize(20);
    part.tracks.associate(part.measured(frame), Slider::wellKnown(), &part.window);
  }
  slide({3, 7, {}}, &part.window);
  EXPECT_EQ(part.window.landmarks.size(), 20U);
}

TEST(Slide, WhereNothingIsSeenLandmarksWaitForImages) {
  Slider slider;
  for (int k = 1; k <= 3; ++k) slider.add(false, 0.05, false);
  slide({3, 7, {}}, &slider.window);
  EXPECT_EQ(slider.window.landmarks.size(), 30U);
}

TEST(Slide, TheOldestKeyframesGoDownToTheirNumberAndLandmarksGetAnotherHost) {
  Slider slider;
  std::map<LandmarkId, Vector3d> places;
  MapOptions off;
  off.enabled = false;
  for (int k = 1; k <= 12; ++k) {
    slider.add(true);
    places.clear();
    for (const auto& [id, landmark] : slider.window.landmarks)
      places[id] = slider.window.states[landmark.host].now.T_WB * landmark.in_host.position();
    slide({3, 4, off}, &slider.window);
    EXPECT_LE(slider.window.firstFull(), 4U);
    EXPECT_LE(slider.window.states.size(), 7U);
    for (const auto& [id, landmark] : slider.window.landmarks) {
      const WindowState& host = slider.window.states[landmark.host];
      EXPECT_EQ(host.serial, landmark.host_serial);
      EXPECT_LT((host.now.T_WB * landmark.in_host.position() - places.at(id)).norm(), 1e-9);
      EXPECT_LT((places.at(id) - slider.points[id]).norm(), 1e-5);
    }
  }
  EXPECT_EQ(slider.window.landmarks.size(), 30U);
  EXPECT_EQ(slider.window.firstFull(), 4U);
  EXPECT_EQ(slider.window.prior.unknowns(), 4 * 6 + 15);
  EXPECT_LE(slider.window.prior.rows(), slider.window.prior.unknowns());
  EXPECT_EQ(slider.window.retainedCount(), 0U);
}

TEST(Slide, WithAMapTheKeyframesThatWouldLeaveAreRetainedUpToTheirNumber) {
  Slider slider;
  MapOptions map;
  map.max_keyframes = 3;
  for (int k = 1; k <= 14; ++k) {
    slider.add(k % 5 != 0);  // every fifth frame is no view
    slide({3, 4, map}, &slider.window);
    EXPECT_LE(slider.window.retainedCount(), 3U);
    for (const WindowState& state : slider.window.states)
      if (state.retained) {
        EXPECT_TRUE(state.keyframe && state.is_view && !state.full);
      }
  }
  EXPECT_EQ(slider.window.retainedCount(), 3U);
  EXPECT_EQ(slider.window.firstFull(), 3U + 4U);
}

TEST(Slide, TheMinimumStaysWhereItWasOnceAllIsSolved) {
  // The body keeps its velocity, as the bridged IMU has it: all residuals are zero. What leaves a
  // window then changes nothing.
  Slider slider;
  MapOptions off;
  off.enabled = false;
  for (int k = 1; k <= 8; ++k) {
    slider.add(k % 2 == 0);
    const size_t before = slider.window.states.size();
    WindowSolver({}).solve(&slider.window, SolverOptions().iterations, false);
    slide({3, 3, off}, &slider.window);
    std::vector<SE3> poses;
    for (const WindowState& state : slider.window.states) poses.push_back(state.now.T_WB);
    SolverOptions options;
    options.iterations = 5;
    const SolverResult again =
        WindowSolver(options).solve(&slider.window, options.iterations, false);
    EXPECT_TRUE(again.converged);
    for (size_t i = 0; i < poses.size(); ++i)
      EXPECT_LT((slider.window.states[i].now.T_WB.t - poses[i].t).norm(), 1e-6) << i;
    EXPECT_LE(slider.window.states.size(), before);
  }
}

/** Everything that the window's states are held by, around their estimates. */
NormalEquations equationsOf(Window* window) {
  std::vector<Landmark*> landmarks;
  for (auto& [id, landmark] : window->landmarks)
    if (landmark.observations.size() > 1) landmarks.push_back(&landmark);
  NormalEquations equations(window->unknowns());
  addPrior(*window, window->prior.A.transpose() * window->prior.A, &equations);
  addInertialTerms(*window, &equations);
  VisualTerms().linearize(*window, landmarks, static_cast<int>(window->states.size()), &equations);
  return equations;
}

/** Moves the states off the minimum, those that the prior holds off their linearisation points. */
void disturb(Window* window) {
  for (size_t i = 0; i < window->states.size(); ++i) {
    WindowState& state = window->states[i];
    for (int c = 0; c < state.size(); ++c)
      state.now = state.now.plus(1e-4 * std::sin(3.0 * c + 7.0 * i) * Vector15d::Unit(c));
    if (!state.fixed) state.linearization = state.now;
  }
}

/** That `after` is `before` with the columns `leaving` eliminated, each unknown measured in its own
 * standard deviation. */
void expectEliminated(const NormalEquations& before, const std::vector<Eigen::Index>& leaving,
                      const NormalEquations& after, double tolerance) {
  std::vector<Eigen::Index> staying;
  for (Eigen::Index c = 0; c < before.g.size(); ++c)
    if (std::find(leaving.begin(), leaving.end(), c) == leaving.end()) staying.push_back(c);
  const Eigen::MatrixXd gain =
      before.H(leaving, leaving).ldlt().solve(before.H(leaving, staying)).transpose();
  const Eigen::MatrixXd H = before.H(staying, staying) - gain * before.H(leaving, staying);
  const Eigen::VectorXd g = before.g(staying) - gain * before.g(leaving);
  ASSERT_EQ(H.rows(), after.H.rows());
  const Eigen::VectorXd scale = H.diagonal().cwiseSqrt().cwiseInverse();
  EXPECT_LT((scale.asDiagonal() * (after.H - H) * scale.asDiagonal()).cwiseAbs().maxCoeff(),
            tolerance);
  EXPECT_LT(scale.cwiseProduct(after.g - g).norm(), tolerance * scale.cwiseProduct(g).norm());
}

TEST(Slide, ThePriorIsTheSchurComplementOfWhatLeaves) {
  // Of a keyframe velocity and biases leave, with landmarks that have ended, the IMU and, if it was
  // one, the rest.
  for (const bool at_rest : {false, true}) {
    Slider slider;
    for (int k = 1; k <= 3; ++k) slider.add(true);
    slide({3, 7, {}}, &slider.window);
    slider.add(true);
    Window& window = slider.window;
    ASSERT_TRUE(window.states[1].fixed && window.states[1].full);
    const int oldest = window.states[1].serial;
    disturb(&window);
    window.states[2].at_rest = at_rest;
    for (auto& [id, landmark] : window.landmarks)
      while (id < 12 && landmark.observations.back().serial > oldest)
        landmark.observations.pop_back();
    const NormalEquations before = equationsOf(&window);
    slide({3, 7, {}}, &window);
    ASSERT_EQ(window.landmarks.size(), 18U);
    std::vector<Eigen::Index> leaving;
    for (Eigen::Index c = 6 + 6; c < 6 + 15; ++c) leaving.push_back(c);
    // Rounding grows with the weights of a rest, 1e5.
    expectEliminated(before, leaving, equationsOf(&window), at_rest ? 1e-4 : 1e-6);
  }
}

/** The landmark as every second observation in the window's first seven states shows it, from
 * `first` on, hosted by the first of them. */
Landmark everySecond(const Window& window, const Landmark& landmark, int first) {
  Landmark half = landmark;
  half.observations.clear();
  for (int i = first; i < 7; i += 2) half.observations.push_back(landmark.observations[i]);
  const WindowState &before = window.states[landmark.host], &host = window.states[first];
  half.host = first;
  half.host_serial = host.serial;
  half.in_host = InverseDepthLandmark(
      host.now.T_WB.inverse() * (before.now.T_WB * landmark.in_host.position()),
      window.T_CB[0].inverse().t);
  return half;
}

TEST(Slide, ALandmarkThatIsFollowedLeavesHalfOfItsKeyframesInThePrior) {
  Slider slider;
  SlidingOptions options{3, 6, {}};
  options.map.enabled = false;
  Window& window = slider.window;
  while (window.firstFull() < 6) {
    slider.add(true);
    slide(options, &window);
  }
  slider.add(true);
  disturb(&window);
  Window halves = window;
  const std::vector<int> serials = slider.serials();
  slide(options, &window);
  Eigen::Index gone = 0;
  while (slider.serials()[gone] == serials[gone]) ++gone;
  ASSERT_LT(gone, 6);
  for (const auto& [id, landmark] : window.landmarks)
    EXPECT_EQ(landmark.observations.size(), 6U + gone % 2);  // of seven keyframes, and three frames
  // The same window with two landmarks in place of each that it had.
  const std::map<LandmarkId, Landmark> whole = halves.landmarks;
  for (const auto& [id, landmark] : whole) {
    ASSERT_EQ(landmark.observations.size(), 10U);
    Landmark followed = everySecond(halves, landmark, 1 - gone % 2);
    followed.observations.insert(followed.observations.end(), landmark.observations.end() - 3,
                                 landmark.observations.end());
    halves.landmarks.at(id) = followed;
    halves.landmarks.emplace(LandmarkId(id + 1000), everySecond(halves, landmark, gone % 2));
  }
  std::vector<Eigen::Index> leaving;
  for (Eigen::Index c = 0; c < 6; ++c) leaving.push_back(6 * gone + c);
  for (Eigen::Index c = 6; c < 15; ++c) leaving.push_back(6 * 6 + c);
  expectEliminated(equationsOf(&halves), leaving, equationsOf(&window), 1e-6);
}

TEST(Slide, ARetainedKeyframeIsNobodysNewHost) {
  Slider slider;
  const SlidingOptions options{3, 3, {}};
  for (int k = 1; k <= 6; ++k) {
    slider.add(true);
    slide(options, &slider.window);
  }
  slider.add(true);
  Window& window = slider.window;
  ASSERT_TRUE(window.states[0].retained);
  // Landmark 5 lives in state 1, which is about to leave for good; state 0 sees it, too.
  window.states[1].is_view = false;
  Landmark& landmark = window.landmarks.at(5);
  landmark.host_serial = landmark.host = 1;
  landmark.in_host = InverseDepthLandmark(window.states[1].now.T_WB.inverse() * slider.points[5],
                                          window.T_CB[0].inverse().t);
  ASSERT_EQ(landmark.observations.front().serial, 0);
  slide(options, &window);
  ASSERT_EQ(window.states[1].serial, 2);
  EXPECT_EQ(window.landmarks.at(5).host_serial, 2);
  EXPECT_EQ(window.landmarks.at(5).host, 1);
}

TEST(DispensableKeyframe, IsOneThatHardlySeesWhatTheNewestSees) {
  Slider slider;
  for (int k = 1; k <= 6; ++k) slider.add(true);
  for (size_t i = 0; i < 6; ++i) slider.window.states[i].full = false;
  slider.window.reindex();
  // All states see the same; then state 2 loses nearly everything.
  for (auto& [id, landmark] : slider.window.landmarks)
    if (id > 0)  // it keeps one landmark of thirty; one in twenty is the limit
      landmark.observations.erase(landmark.observations.begin() + 2);
    else
      landmark.observations.pop_back();
  EXPECT_EQ(dispensableKeyframe(slider.window), 2U);
  slider.window.states[2].retained = true;  // the map keeps it
  EXPECT_NE(dispensableKeyframe(slider.window), 2U);
}

TEST(DispensableKeyframe, IsOneThatStandsWhereOthersDo) {
  Slider slider;
  for (const double step : {0.5, 0.5, 0.02, 0.5, 0.5, 0.5}) slider.add(true, step);
  for (size_t i = 0; i < 6; ++i) slider.window.states[i].full = false;
  slider.window.reindex();
  // States 2 and 3 are 2 cm apart; of the two, 2 is farther from the newest.
  EXPECT_EQ(dispensableKeyframe(slider.window), 2U);
  // The newest two stay, whatever they see.
  Slider newest;
  for (const double step : {0.5, 0.5, 0.5, 0.5, 0.001, 0.5}) newest.add(true, step);
  for (size_t i = 0; i < 6; ++i) newest.window.states[i].full = false;
  newest.window.reindex();
  EXPECT_LT(dispensableKeyframe(newest.window), 4U);
}

TEST(Window, ReindexDropsWhatIsGone) {
  Slider slider(10);
  for (int k = 1; k <= 3; ++k) slider.add(k == 2);
  slider.window.landmarks.at(4).host_serial = 2;
  slider.window.landmarks.at(4).host = 2;
  slider.window.landmarks.at(5).observations.resize(1);  // the host's alone
  slider.window.states[1].full = false;
  slider.window.states.erase(slider.window.states.begin());
  slider.window.reindex();
  ASSERT_EQ(slider.window.landmarks.size(), 1U);  // all others' host is gone
  const Landmark& landmark = slider.window.landmarks.at(4);
  EXPECT_EQ(landmark.host, 1);
  ASSERT_EQ(landmark.observations.size(), 3U);
  for (int i = 0; i < 3; ++i) EXPECT_EQ(landmark.observations[i].state, i);
  EXPECT_EQ(slider.window.states[0].column, 0);
  EXPECT_EQ(slider.window.states[1].column, 6);
  EXPECT_EQ(slider.window.states[2].column, 21);
  EXPECT_EQ(slider.window.unknowns(), 36);
  EXPECT_EQ(slider.window.firstFull(), 1U);
  EXPECT_EQ(Window().unknowns(), 0);
}

TEST(Window, DeltasAreThoseOfFixedStatesAlone) {
  Slider slider(10);
  slider.add(false);
  slider.window.states[0].now =
      slider.window.states[0].linearization.plus(1e-3 * Vector15d::LinSpaced(15, 1.0, 15.0));
  slider.window.states[1].now = slider.window.states[1].now.plus(Vector15d::Ones());
  const Eigen::VectorXd all = deltas(slider.window, 30);
  EXPECT_LT((all.head<15>() - 1e-3 * Vector15d::LinSpaced(15, 1.0, 15.0)).norm(), 1e-9);
  EXPECT_EQ(all.tail<15>().norm(), 0.0);
  EXPECT_EQ(deltas(slider.window, 6).size(), 6);
}

}  // namespace
}  // namespace etalon::fixed_lag
