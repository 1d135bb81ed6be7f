#include "recall.h"

#include <algorithm>
#include <cmath>
#include <map>

namespace etalon::fixed_lag {
namespace {

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

struct Recall::Candidate {
  size_t state = 0;
  OldView view;
  std::vector<size_t> seen;  ///< indices
  std::vector<ViewQuery> queries;
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

std::vector<RecalledObservation> Recall::recall(const TrackedFrame& frame, ViewMatcher* matcher,
                                                const WindowSolver& solver, Window* window) const {
  const std::vector<SeenLandmark> seen = seenLandmarks(frame, *window);
  const WindowState& newest = window->states.back();
  const double sigma_px = sigma_px_ * options_.sigma_factor * std::sqrt(window->pixel_variance);
  std::vector<Candidate> candidates;
  for (size_t i = 0; i < window->firstFull(); ++i) {
    const WindowState& state = window->states[i];
    if (!state.retained) continue;
    Candidate candidate;
    candidate.state = i;
    candidate.view.T_NV = relativePose(newest.seenFrom(), state.seenFrom());
    for (size_t l = 0; l < seen.size(); ++l) {
      const Landmark& landmark = window->landmarks.at(seen[l].id);
      const auto& sought = landmark.sought;
      if (std::find(sought.begin(), sought.end(), state.serial) != sought.end()) continue;
      const auto& all = landmark.observations;
      if (std::any_of(all.begin(), all.end(),
                      [&state](const LandmarkObservation& o) { return o.serial == state.serial; }))
        continue;
      if (isInView(*calibration_, candidate.view.T_NV, seen[l])) candidate.seen.push_back(l);
    }
    if (candidate.seen.size() >= static_cast<size_t>(options_.min_landmarks))
      candidates.push_back(std::move(candidate));
  }
  std::stable_sort(candidates.begin(), candidates.end(),
                   [](const auto& a, const auto& b) { return a.seen.size() > b.seen.size(); });
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
    Eigen::Matrix<double, 12, 12> P;
    const Eigen::Index at = 6 + 6 * k;
    P << joint.topLeftCorner<6, 6>(), joint.block<6, 6>(0, at), joint.block<6, 6>(at, 0),
        joint.block<6, 6>(at, at);
    candidate.view.covariance = relativeCovariance(newest.seenFrom(), state.seenFrom(), P);
    candidate.view.covariance.diagonal().array() += 1e-10;
    // Of too many every n-th is taken: neighbouring ids began together, all over the image.
    const size_t most = std::min(candidate.seen.size(), static_cast<size_t>(options_.landmarks));
    std::vector<size_t> asked;
    for (size_t i = 0; i < most; ++i) {
      const size_t l = candidate.seen[i * candidate.seen.size() / most];
      const auto query = predictInView(*calibration_, candidate.view, seen[l], sigma_px);
      if (!query) continue;
      asked.push_back(l);
      candidate.queries.push_back(*query);
    }
    candidate.seen = std::move(asked);
    search(candidate, seen, matcher, window, &recalled);
  }
  return recalled;
}

void Recall::search(const Candidate& candidate, const std::vector<SeenLandmark>& seen,
                    ViewMatcher* matcher, Window* window,
                    std::vector<RecalledObservation>* recalled) const {
  WindowState& state = window->states[candidate.state];
  const std::vector<ViewMatch> matches = matcher->find(state.t, candidate.queries);
  std::vector<FoundLandmark> found;
  std::map<size_t, const ViewMatch*> match_of;  // by the landmark's index
  for (size_t i = 0; i < matches.size(); ++i) {
    if (!matches[i].found) continue;
    const auto f = foundLandmark(*calibration_, candidate.seen[i], matches[i],
                                 sigma_px_ * options_.sigma_factor);
    if (!f) continue;
    found.push_back(*f);
    match_of[f->landmark] = &matches[i];
  }
  const std::vector<FoundLandmark> believed =
      agreeing(*calibration_, candidate.view, seen, found, window->pixel_variance, options_);
  for (const FoundLandmark& f : believed) {
    Landmark& landmark = window->landmarks.at(seen[f.landmark].id);
    const ViewMatch& match = *match_of.at(f.landmark);
    LandmarkObservation observation{state.serial, static_cast<int>(candidate.state), f.has_right,
                                    f.measurements};
    const double look = 1 + noteFound(match.left, &state);
    for (ReprojectionMeasurement& m : observation.measurements)
      m.sqrt_information /= std::sqrt(look);
    addObservation(observation, &landmark);
    recalled->push_back({state.t, {landmark.id, match.left, match.right, f.has_right}});
  }
  // Once the view is found, no landmark is looked for there a second time.
  if (!believed.empty())
    for (const size_t l : candidate.seen)
      window->landmarks.at(seen[l].id).sought.push_back(state.serial);
}

}  // namespace etalon::fixed_lag
