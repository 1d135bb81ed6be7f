#include "recall.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

#include "etalon/core/so3.h"
#include "etalon/core/yaw.h"

namespace etalon::fixed_lag {
namespace {

using Matrix6d = Eigen::Matrix<double, 6, 6>;
using Matrix12d = Eigen::Matrix<double, 12, 12>;

/** Of dead reckoning's standard deviations, when it is to refuse a place: a wrong one is farther. */
constexpr double kCaution = 2.0;
/** Where a prediction is farther off than patches can be aligned, some landmarks agree by chance. */
constexpr double kDoubtfulReachPx = 40.0;
constexpr double kChi2Pose = 22.46;  // 6 degrees of freedom, 99.9 %

/** Of p_N, from the parameters in the host. */
Eigen::Matrix3d covarianceInNewest(const Landmark& landmark, const Eigen::Matrix3d& R_NH) {
  const Eigen::Vector3d& x = landmark.in_host.parameters;
  Eigen::Matrix3d J;
  J.leftCols<2>() = landmark.in_host.axes.leftCols<2>() / x.z();
  J.col(2) = -landmark.in_host.axes * Eigen::Vector3d(x.x(), x.y(), 1.0) / (x.z() * x.z());
  J = (R_NH * J).eval();
  return J * landmark.covariance * J.transpose();
}

void addObservation(const LandmarkObservation& observation, Landmark* landmark) {
  auto& all = landmark->observations;
  const auto after = std::find_if(all.begin(), all.end(), [&](const LandmarkObservation& o) {
    return o.serial > observation.serial;
  });
  all.insert(after, observation);
}

/** Whether the state sees the landmark, or was asked before. */
bool isKnown(const Landmark& landmark, int serial) {
  const auto& all = landmark.observations;
  const auto& sought = landmark.sought;
  return std::find(sought.begin(), sought.end(), serial) != sought.end() ||
         std::any_of(all.begin(), all.end(),
                     [serial](const LandmarkObservation& o) { return o.serial == serial; });
}

/** Notes that a landmark was found there, and how often this was so before: a point of the scene
 * that comes into view again is another landmark, but the old image errs there as it did. */
int noteFound(const Eigen::Vector2d& pixel, WindowState* state) {
  constexpr double kSamePoint_px = 2.0;
  auto& points = state->found_again;
  auto point = std::find_if(points.begin(), points.end(), [&pixel](const FoundPoint& p) {
    return (p.pixel - pixel).norm() < kSamePoint_px;
  });
  if (point == points.end()) point = points.insert(point, {pixel, 0});
  return point->times++;
}

}  // namespace

/** A retained keyframe that should show landmarks. */
struct Recall::Candidate {
  size_t state = 0;
  OldView view;              ///< as the states have it
  std::vector<size_t> seen;  ///< indices of the landmarks
};

std::vector<SeenLandmark> Recall::seenLandmarks(const TrackedFrame& frame,
                                                const Window& window) const {
  constexpr size_t kMinObservations = 3;
  const WindowState& newest = window.states.back();
  std::vector<SeenLandmark> seen;
  for (const Observation& o : frame.observations) {
    const auto known = window.landmarks.find(o.id);
    if (known == window.landmarks.end()) continue;
    const Landmark& landmark = known->second;
    if (!landmark.seenIn(newest.serial) || landmark.observations.size() < kMinObservations ||
        !(landmark.in_host.parameters.z() > 1e-3))
      continue;
    const SE3 T_NH = relativePose(newest.seenFrom(), window.states[landmark.host].seenFrom());
    seen.push_back(
        {o.id, o.left, T_NH * landmark.in_host.position(), covarianceInNewest(landmark, T_NH.R)});
  }
  return seen;
}

std::vector<Recall::Candidate> Recall::candidatesFor(const std::vector<SeenLandmark>& seen,
                                                     const Window& window) const {
  const WindowState& newest = window.states.back();
  std::vector<Candidate> candidates;
  for (size_t i = 0; i < window.firstFull(); ++i) {
    const WindowState& state = window.states[i];
    if (!state.retained) continue;
    Candidate candidate;
    candidate.state = i;
    candidate.view.T_NV = relativePose(newest.seenFrom(), state.seenFrom());
    for (size_t l = 0; l < seen.size(); ++l) {
      if (isKnown(window.landmarks.at(seen[l].id), state.serial)) continue;
      if (isInView(*calibration_, candidate.view.T_NV, seen[l])) candidate.seen.push_back(l);
    }
    if (candidate.seen.size() >= static_cast<size_t>(options_.min_landmarks))
      candidates.push_back(std::move(candidate));
  }
  std::stable_sort(candidates.begin(), candidates.end(),
                   [](const auto& a, const auto& b) { return a.seen.size() > b.seen.size(); });
  return candidates;
}

/** The retained keyframe up to `after` whose turn it is; null where there is none. Those that the
 * prediction has in view come three times as often as the others. */
WindowState* Recall::toRecognize(TimeNs after, const std::vector<SeenLandmark>& seen,
                                 Window* window) const {
  constexpr double kNeverTriedS = 60.0, kInView = 3.0;
  std::vector<double> turn(window->firstFull(), 1.0);
  for (const Candidate& candidate : candidatesFor(seen, *window)) turn[candidate.state] = kInView;
  WindowState* next = nullptr;
  double longest = 0.0;
  for (size_t i = 0; i < turn.size(); ++i) {
    WindowState& state = window->states[i];
    if (!state.retained || state.t > after) continue;
    turn[i] *= state.recognition_tried
                   ? secondsBetween(*state.recognition_tried, window->states.back().t)
                   : kNeverTriedS;
    if (turn[i] > longest) {
      longest = turn[i];
      next = &state;
    }
  }
  return next;
}

ViewSearch Recall::searchWith(ViewMatcher* matcher, const Window& window) const {
  return {*calibration_, options_, sigma_px_ * options_.sigma_factor, window.pixel_variance,
          *matcher};
}

std::vector<RecalledObservation> Recall::recall(const TrackedFrame& frame, ViewMatcher* matcher,
                                                const WindowSolver& solver, Window* window) const {
  const std::vector<SeenLandmark> seen = seenLandmarks(frame, *window);
  const WindowState& newest = window->states.back();
  std::vector<Candidate> candidates = candidatesFor(seen, *window);
  if (candidates.size() > static_cast<size_t>(options_.views)) candidates.resize(options_.views);
  if (candidates.empty()) return {};

  std::vector<Eigen::Index> unknowns;
  for (Eigen::Index c = 0; c < 6; ++c) unknowns.push_back(newest.column + c);
  for (const Candidate& candidate : candidates)
    for (Eigen::Index c = 0; c < 6; ++c)
      unknowns.push_back(window->states[candidate.state].column + c);
  const Eigen::MatrixXd joint = solver.covariance(unknowns);
  if (joint.size() == 0) return {};
  std::vector<RecalledObservation> recalled;
  for (size_t k = 0; k < candidates.size(); ++k) {
    Candidate& candidate = candidates[k];
    const WindowState& state = window->states[candidate.state];
    Matrix12d P;
    const Eigen::Index at = 6 + 6 * k;
    P << joint.topLeftCorner<6, 6>(), joint.block<6, 6>(0, at), joint.block<6, 6>(at, 0),
        joint.block<6, 6>(at, at);
    candidate.view.covariance = relativeCovariance(newest.seenFrom(), state.seenFrom(), P);
    candidate.view.covariance.diagonal().array() += 1e-10;
    // Of too many every n-th is taken: neighbouring ids began together, all over the image.
    const size_t most = std::min(candidate.seen.size(), static_cast<size_t>(options_.landmarks));
    std::vector<size_t> which;
    for (size_t i = 0; i < most; ++i)
      which.push_back(candidate.seen[i * candidate.seen.size() / most]);
    const ViewFindings findings =
        searchWith(matcher, *window).find(state.t, candidate.view, seen, which);
    if (findings.reach_px > kDoubtfulReachPx && !findings.confirmGuess()) continue;
    observe(candidate.state, findings, seen, window, &recalled);
  }
  return recalled;
}

std::optional<Recognition> Recall::recognize(const TrackedFrame& frame,
                                             const std::vector<TimeNs>& after, ViewMatcher* matcher,
                                             const WindowSolver& solver, Window* window,
                                             std::vector<RecalledObservation>* recalled) const {
  const std::vector<SeenLandmark> seen = seenLandmarks(frame, *window);
  WindowState* const old = toRecognize(after.back(), seen, window);
  if (!old) return std::nullopt;
  const WindowState &state = *old, &newest = window->states.back();
  old->recognition_tried = newest.t;
  const auto guess = matcher->recognize(state.t);
  if (!guess) return std::nullopt;
  std::vector<size_t> which;  // not only where the states have them in view
  for (size_t l = 0; l < seen.size(); ++l)
    if (!isKnown(window->landmarks.at(seen[l].id), state.serial)) which.push_back(l);
  const ViewFindings findings = searchWith(matcher, *window).find(state.t, *guess, seen, which);
  if (!findings.confirmGuess()) return std::nullopt;
  const OldView view =
      aligned(*calibration_, *guess, seen, findings.landmarks, window->pixel_variance);

  std::vector<Eigen::Index> unknowns;
  for (const Eigen::Index column : {newest.column, state.column})
    for (Eigen::Index c = 0; c < 6; ++c) unknowns.push_back(column + c);
  const Eigen::MatrixXd joint = solver.covariance(unknowns);
  if (joint.size() == 0) return std::nullopt;
  const Matrix6d covariance =
      view.covariance +
      kCaution * kCaution * relativeCovariance(newest.seenFrom(), state.seenFrom(), joint);
  Eigen::Matrix<double, 6, 1> off;
  const SE3 T_NV = relativePose(newest.seenFrom(), state.seenFrom());
  off << logSO3(T_NV.R.transpose() * view.T_NV.R), view.T_NV.t - T_NV.t;
  if (!(off.dot(covariance.llt().solve(off)) < kChi2Pose)) return std::nullopt;

  const Recognition recognition{
      state.t, *std::lower_bound(after.begin(), after.end(), state.t),
      yawPositionAlignment(newest.seenFrom(), state.seenFrom() * view.T_NV.inverse())};
  observe(old - window->states.data(), findings, seen, window, recalled);
  for (WindowState& later : window->states) {
    if (later.t <= recognition.after) continue;
    later.now = later.now.moved(recognition.T_WW0);
    if (!later.fixed) later.linearization = later.now;
  }
  return recognition;
}

void Recall::observe(size_t view, const ViewFindings& findings,
                     const std::vector<SeenLandmark>& seen, Window* window,
                     std::vector<RecalledObservation>* recalled) const {
  WindowState& state = window->states[view];
  for (size_t i = 0; i < findings.landmarks.size(); ++i) {
    const FoundLandmark& f = findings.landmarks[i];
    LandmarkObservation observation{state.serial, static_cast<int>(view), f.match.has_right,
                                    f.measurements};
    const double look = 1 + noteFound(f.match.left, &state);
    for (ReprojectionMeasurement& m : observation.measurements)
      m.sqrt_information /= std::sqrt(look);
    addObservation(observation, &window->landmarks.at(seen[f.landmark].id));
    recalled->push_back({state.t, findings.observations[i]});
  }
  // Once the view is found, no landmark is looked for there a second time.
  if (!findings.landmarks.empty())
    for (const size_t l : findings.asked)
      window->landmarks.at(seen[l].id).sought.push_back(state.serial);
}

}  // namespace etalon::fixed_lag
