#include "sliding.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include "etalon/map/view_selection.h"
#include "rest.h"
#include "window_solver.h"

namespace etalon::fixed_lag {
namespace {

/** The columns of the unknowns that leave. */
std::vector<Eigen::Index> columnsOf(const WindowState& state, Eigen::Index first) {
  std::vector<Eigen::Index> columns;
  for (Eigen::Index i = first; i < state.size(); ++i) columns.push_back(state.column + i);
  return columns;
}

/** Makes the next keyframe that sees the landmark its host, because the present host leaves; false
 * if there is none. */
bool moveHost(const Window& window, Landmark* landmark) {
  const SE3 T_WH = window.states[landmark->host].seenFrom();
  for (const LandmarkObservation& o : landmark->observations) {
    const WindowState& state = window.states[o.state];
    if (o.state == landmark->host || !state.keyframe || state.retained) continue;
    const SE3 T_NH = relativePose(state.seenFrom(), T_WH);
    const Eigen::Vector3d camera_N = window.T_CB[0].inverse().t;
    landmark->in_host = InverseDepthLandmark(T_NH * landmark->in_host.position(), camera_N);
    landmark->host_serial = state.serial;
    landmark->host = o.state;
    return true;
  }
  return false;
}

/** Takes out the landmarks that none of the newest full states sees; none where these see nothing at
 * all: their tracks may go on when there are images again. */
std::vector<Landmark> takeEndedLandmarks(size_t oldest_full, Window* window) {
  const int newest = window->states[oldest_full].serial;
  std::vector<LandmarkId> ids;
  for (const auto& [id, landmark] : window->landmarks)
    if (landmark.observations.back().serial <= newest) ids.push_back(id);
  std::vector<Landmark> ended;
  if (ids.size() == window->landmarks.size()) return ended;
  for (const LandmarkId id : ids) {
    // The pose of a later host, in which it has turned out to be an outlier, does not leave yet.
    Landmark& landmark = window->landmarks.at(id);
    if (static_cast<size_t>(landmark.host) > oldest_full && !moveHost(*window, &landmark)) continue;
    ended.push_back(std::move(window->landmarks.extract(id).mapped()));
  }
  return ended;
}

/** Takes every second observation in keyframes out of a landmark that is still followed, with that in
 * `gone`, as a landmark of its own; none where one of the two would have less than three. */
std::optional<Landmark> takeHalf(const Window& window, int gone, size_t oldest_full,
                                 Landmark* landmark) {
  const auto& all = landmark->observations;
  const auto seenIn = [](const std::vector<LandmarkObservation>& observations, int serial) {
    return std::find_if(observations.begin(), observations.end(),
                        [serial](const LandmarkObservation& o) { return o.serial == serial; });
  };
  const auto at = seenIn(all, gone);
  const auto in_keyframes =
      std::count_if(all.begin(), all.end(), [oldest_full](const LandmarkObservation& o) {
        return static_cast<size_t>(o.state) <= oldest_full;
      });
  if (at == all.end() || in_keyframes < 6) return std::nullopt;
  Landmark half = *landmark, rest = *landmark;
  half.observations.clear();
  rest.observations.clear();
  for (auto o = all.begin(); o != all.end(); ++o) {
    const bool taken = o - all.begin() < in_keyframes && (o - at) % 2 == 0;
    (taken ? half : rest).observations.push_back(*o);
  }
  if (seenIn(half.observations, landmark->host_serial) == half.observations.end())
    moveHost(window, &half);
  else if (!moveHost(window, &rest))
    return std::nullopt;
  *landmark = std::move(rest);
  return half;
}

/** squareRoot() of the equations in the first `unknowns`, most of which may not occur in them. */
LinearRows touchedRows(const NormalEquations& equations, Eigen::Index unknowns) {
  std::vector<Eigen::Index> touched;
  for (Eigen::Index i = 0; i < unknowns; ++i)
    if (equations.H(i, i) > 0.0) touched.push_back(i);
  const LinearRows of_touched = squareRoot(equations.H(touched, touched), equations.g(touched));
  LinearRows rows(of_touched.rows(), unknowns);
  rows.A(Eigen::all, touched) = of_touched.A;
  rows.b = of_touched.b;
  return rows;
}

/** The rows that leave, over the window's first `unknowns` columns: those of the prior, the IMU, a
 * rest and the landmarks, which are not the window's any more. */
LinearRows rowsOf(const Window& window, size_t oldest_full, std::vector<Landmark>* landmarks,
                  Eigen::Index unknowns) {
  Matrix15d J_i, J_j;
  const Vector15d imu = inertialRows(window, oldest_full + 1, &J_i, &J_j);
  NormalEquations visual(window.unknowns());
  LinearRows visual_rows(0, unknowns);
  if (!landmarks->empty()) {
    std::vector<Landmark*> pointers;
    for (Landmark& landmark : *landmarks) pointers.push_back(&landmark);
    VisualTerms terms;
    terms.linearize(window, pointers, static_cast<int>(oldest_full), &visual,
                    window.calibration.unknown);
    visual_rows = touchedRows(visual, unknowns);
  }
  const bool at_rest = window.states[oldest_full + 1].at_rest;
  LinearRows rows(window.prior.rows() + 15 + (at_rest ? 9 : 0) + visual_rows.rows(), unknowns);
  const Eigen::VectorXd delta = deltas(window, unknowns);
  rows.A.topLeftCorner(window.prior.rows(), window.prior.unknowns()) = window.prior.A;
  rows.b.head(window.prior.rows()) = window.prior.b;
  const Eigen::Index column = window.states[oldest_full].column;
  rows.A.block<15, 15>(window.prior.rows(), column) = J_i;
  rows.A.block<15, 15>(window.prior.rows(), column + 15) = J_j;
  // Costs around the estimates become costs around the linearisation points.
  rows.b.segment<15>(window.prior.rows()) =
      imu - J_i * delta.segment<15>(column) - J_j * delta.segment<15>(column + 15);
  if (at_rest) {
    const Eigen::Index row = window.prior.rows() + 15;
    RestJacobian rest_i, rest_j;
    const Eigen::Matrix<double, 9, 1> rest = restRows(window, oldest_full + 1, &rest_i, &rest_j);
    rows.A.block<9, 15>(row, column) = rest_i;
    rows.A.block<9, 15>(row, column + 15) = rest_j;
    rows.b.segment<9>(row) =
        rest - rest_i * delta.segment<15>(column) - rest_j * delta.segment<15>(column + 15);
  }
  rows.A.bottomRows(visual_rows.rows()) = visual_rows.A;
  rows.b.tail(visual_rows.rows()) = visual_rows.b - visual_rows.A * delta;
  return rows;
}

/** Takes the columns out of the rows. */
LinearRows without(const LinearRows& rows, const std::vector<Eigen::Index>& leaving) {
  std::vector<Eigen::Index> order = leaving;
  for (Eigen::Index c = 0; c < rows.unknowns(); ++c)
    if (std::find(leaving.begin(), leaving.end(), c) == leaving.end()) order.push_back(c);
  LinearRows ordered;
  ordered.A = rows.A(Eigen::all, order);
  ordered.b = rows.b;
  return compressed(marginalizeFirst(ordered, leaving.size()));
}

/** The retained keyframe that is least needed. */
size_t redundantKeyframe(const Window& window, const MapOptions& options) {
  std::vector<SE3> T_WC;
  std::vector<size_t> index;
  const SE3 T_BC = window.T_CB[0].inverse();
  for (size_t i = 0; i < window.firstFull(); ++i)
    if (window.states[i].retained) {
      T_WC.push_back(window.states[i].now.T_WB * T_BC);
      index.push_back(i);
    }
  return index[redundantView(T_WC, options)];
}

}  // namespace

size_t dispensableKeyframe(const Window& window) {
  const size_t count = window.firstFull();
  std::vector<int> hosted(count, 0), alive(count, 0);
  const int newest = window.states.back().serial;
  for (const auto& [id, landmark] : window.landmarks)
    for (const LandmarkObservation& o : landmark.observations)
      if (static_cast<size_t>(o.state) < count) {
        ++hosted[o.state];
        alive[o.state] += landmark.seenIn(newest);
      }
  // The newest two stay, so that a landmark always finds another host.
  for (size_t i = 0; i + 2 < count; ++i)
    if (!window.states[i].retained && (alive[i] < 0.05 * hosted[i] || alive[i] == 0)) return i;
  size_t worst = 0;
  double largest = -1.0;
  const Eigen::Vector3d p = window.states.back().now.T_WB.t;
  for (size_t i = 0; i + 2 < count; ++i) {
    if (window.states[i].retained) continue;
    double near = 0.0;
    for (size_t j = 0; j + 2 < count; ++j)
      if (i != j && !window.states[j].retained)
        near += 1.0 / ((window.states[i].now.T_WB.t - window.states[j].now.T_WB.t).norm() + 1e-3);
    const double score = std::sqrt((window.states[i].now.T_WB.t - p).norm()) * near;
    if (score > largest) {
      largest = score;
      worst = i;
    }
  }
  return worst;
}

void slide(const SlidingOptions& options, Window* window) {
  const size_t oldest = window->firstFull();
  const size_t full = window->states.size() - oldest;
  if (full <= static_cast<size_t>(options.recent_frames)) return;
  WindowState& leaving = window->states[oldest];
  std::vector<Eigen::Index> columns = columnsOf(leaving, leaving.keyframe ? 6 : 0);
  std::vector<Landmark> landmarks;  // that leave
  int gone = -1;                    // serial
  if (leaving.keyframe) {
    if (oldest - window->retainedCount() >= static_cast<size_t>(options.keyframes)) {
      size_t least = dispensableKeyframe(*window);
      const bool retains = options.map.enabled && window->states[least].is_view;
      window->states[least].retained = retains;
      const bool all_stay =
          retains && window->retainedCount() <= static_cast<size_t>(options.map.max_keyframes);
      if (retains && !all_stay) least = redundantKeyframe(*window, options.map);
      if (!all_stay) {
        gone = window->states[least].serial;
        for (const Eigen::Index c : columnsOf(window->states[least], 0)) columns.push_back(c);
      }
    }
    landmarks = takeEndedLandmarks(oldest, window);
    for (auto& [id, landmark] : window->landmarks)
      if (auto half = takeHalf(*window, gone, oldest, &landmark))
        landmarks.push_back(std::move(*half));
  } else {
    gone = leaving.serial;
  }
  const WindowState& next = window->states[oldest + 1];
  const Eigen::Index unknowns = next.column + next.size();
  const LinearRows rows = rowsOf(*window, oldest, &landmarks, unknowns);
  for (size_t i = 0; i <= oldest + 1; ++i) window->states[i].fixed = true;
  window->prior = without(rows, columns);

  for (auto& [id, landmark] : window->landmarks)
    if (landmark.host_serial == gone && !moveHost(*window, &landmark)) landmark.host_serial = -1;
  leaving.full = false;
  window->states.erase(std::remove_if(window->states.begin(), window->states.end(),
                                      [gone](const WindowState& s) { return s.serial == gone; }),
                       window->states.end());
  window->reindex();
}

}  // namespace etalon::fixed_lag
