#include "tracks.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>

#include "etalon/core/so3.h"
#include "etalon/optimization/bundle/visual_window.h"
#include "relative_views.h"

namespace etalon::fixed_lag {
namespace {

constexpr double kKeyframeUnlocatedS = 0.25;

/** Squared residual of the track against the landmark in both cameras, divided by its bound: the
 * track is too far away where it exceeds 1. */
double distance(const Window& window, const Landmark& landmark, const MeasuredFrame::Track& track,
                const Eigen::Matrix<double, 6, 6>& pose_covariance, double gate) {
  const WindowState& host = window.states[landmark.host];
  const SE3 T_HT = relativePose(host.seenFrom(), window.states.back().seenFrom());
  double worst = 0.0;
  for (size_t camera = track.has_left ? 0 : 1; camera < (track.has_right ? 2u : 1u); ++camera) {
    Eigen::Vector2d r;
    Eigen::Matrix<double, 2, 6> J_pose;
    Eigen::Matrix<double, 2, 3> J_landmark;
    if (!reprojectionResidual(window.T_CB[camera], track.measurements[camera], T_HT,
                              landmark.in_host, &r, &J_pose, &J_landmark))
      return 1e9;
    J_pose.rightCols<3>() *= host.now.T_WB.R.transpose();
    Eigen::Matrix2d S = J_pose * pose_covariance * J_pose.transpose() +
                        J_landmark * landmark.covariance * J_landmark.transpose();
    S.diagonal().array() += 1.0;
    worst = std::max(worst, r.dot(S.inverse() * r) / gate);
  }
  return worst;
}

/** Of the landmark's parameters, given the poses, by the noise of the pixels that see it. */
Eigen::Matrix3d triangulationCovariance(const Window& window, const Landmark& landmark) {
  const SE3& T_WH = window.states[landmark.host].seenFrom();
  // An inverse distance that the pixels do not tell is known to 1 / mm all the same.
  Eigen::Matrix3d information = Eigen::Vector3d(0.0, 0.0, 1e-6).asDiagonal();
  for (const LandmarkObservation& o : landmark.observations) {
    const SE3 T_HT = relativePose(T_WH, window.states[o.state].seenFrom());
    for (size_t camera = o.first(); camera < o.end(); ++camera) {
      Eigen::Vector2d r;
      Eigen::Matrix<double, 2, 6> J_pose;
      Eigen::Matrix<double, 2, 3> J;
      if (reprojectionResidual(window.T_CB[camera], o.measurements[camera], T_HT, landmark.in_host,
                               &r, &J_pose, &J))
        information += J.transpose() * J;
    }
  }
  return window.pixel_variance * information.inverse();
}

/** The ray in the body's axes: the left camera's, or the right one's where that alone sees it. */
Eigen::Vector3d rayInBody(const MeasuredFrame::Track& track, const Window& window) {
  const size_t camera = track.has_left ? 0 : 1;
  return window.T_CB[camera].R.transpose() * track.measurements[camera].ray();
}

}  // namespace

MeasuredFrame measure(const StereoInertialCalibration& calibration, const TrackedFrame& frame,
                      double sigma_px) {
  MeasuredFrame measured;
  measured.t = frame.t;
  measured.tracks.reserve(frame.observations.size());
  for (const Observation& o : frame.observations) {
    const auto left = makeMeasurement(calibration.cameras[0].model, o.left, sigma_px);
    if (!left) continue;
    MeasuredFrame::Track track;
    track.id = o.id;
    track.measurements[0] = *left;
    if (o.has_right) {
      const auto right = makeMeasurement(calibration.cameras[1].model, o.right, sigma_px);
      track.has_right = right.has_value();
      if (right) track.measurements[1] = *right;
    }
    measured.tracks.push_back(track);
  }
  if (frame.right_only.empty()) return measured;
  for (const RightObservation& o : frame.right_only) {
    const auto right = makeMeasurement(calibration.cameras[1].model, o.right, sigma_px);
    if (!right) continue;
    MeasuredFrame::Track track;
    track.id = o.id;
    track.has_left = false;
    track.has_right = true;
    track.measurements[1] = *right;
    measured.tracks.push_back(track);
  }
  std::sort(measured.tracks.begin(), measured.tracks.end(),
            [](const auto& a, const auto& b) { return a.id < b.id; });
  return measured;
}

Tracks::Counts Tracks::associate(const MeasuredFrame& frame,
                                 const Eigen::Matrix<double, 6, 6>& pose_covariance,
                                 Window* window) {
  std::vector<std::pair<Landmark*, const MeasuredFrame::Track*>> agreeing, others;
  for (const MeasuredFrame::Track& track : frame.tracks) {
    const auto rejected = rejected_.find(track.id);
    if (rejected != rejected_.end()) {
      rejected->second = 0;
      continue;
    }
    const auto known = window->landmarks.find(track.id);
    if (known == window->landmarks.end()) continue;
    const bool agrees =
        distance(*window, known->second, track, pose_covariance, options_.chi2_gate) < 1.0;
    (agrees ? agreeing : others).emplace_back(&known->second, &track);
  }
  forgetEndedTracks(frame);
  Counts counts;
  // If most tracks disagree with the prediction, the prediction is wrong.
  if (others.size() > agreeing.size()) {
    agreeing.insert(agreeing.end(), others.begin(), others.end());
    others.clear();
  }
  const WindowState& newest = window->states.back();
  for (const auto& [landmark, track] : agreeing)
    landmark->observations.push_back({newest.serial, static_cast<int>(window->states.size()) - 1,
                                      track->has_right, track->measurements, track->has_left});
  for (const auto& [landmark, track] : others)
    if (++landmark->strikes >= 2) rejected_[track->id] = 0;
  counts.used = agreeing.size();
  counts.gated = others.size();
  return counts;
}

void Tracks::forgetEndedTracks(const MeasuredFrame& frame) {
  constexpr int kEnded = 10;  // frames; the front end leaves a track out while it seeks its anchor
  if (frame.tracks.empty()) return;
  for (auto it = rejected_.begin(); it != rejected_.end();)
    it = it->second++ > kEnded ? rejected_.erase(it) : std::next(it);
}

bool Tracks::wantsKeyframe(const MeasuredFrame& frame, const Counts& counts,
                           const Window& window) const {
  const auto tracks = static_cast<int>(frame.tracks.size());
  if (tracks < kLocatedBy) return false;
  const bool is_located = counts.used >= kLocatedBy;
  if (is_located && counts.used < options_.keyframe_survival * tracks) return true;
  const Eigen::Matrix3d R_LB = last_R_WB_.transpose() * window.states.back().now.T_WB.R;
  std::vector<double> parallax;
  for (const MeasuredFrame::Track& track : frame.tracks) {
    const auto before = last_keyframe_.find(track.id);
    if (before == last_keyframe_.end() || before->second.has_left != track.has_left) continue;
    parallax.push_back(angleBetween(R_LB * rayInBody(track, window), before->second.ray));
  }
  // Not located, tracks of one camera need keyframes that are apart from each other.
  if (!is_located && (parallax.size() < options_.keyframe_survival * tracks ||
                      secondsBetween(last_keyframe_at_, frame.t) > kKeyframeUnlocatedS))
    return true;
  if (parallax.empty()) return true;
  auto middle = parallax.begin() + parallax.size() / 2;
  std::nth_element(parallax.begin(), middle, parallax.end());
  return *middle * calibration_->cameras[0].model.focal().x() > options_.keyframe_parallax_px;
}

void Tracks::createLandmarks(const MeasuredFrame& frame, Window* window) {
  const WindowState& newest = window->states.back();
  const int newest_index = static_cast<int>(window->states.size()) - 1;
  VisualWindow views;
  views.T_CB = window->T_CB;
  views.keyframe_count = window->states.size();
  views.first.push_back(0);
  std::vector<std::vector<LandmarkObservation>> observations;
  std::map<LandmarkId, std::vector<LandmarkObservation>> pending;
  last_keyframe_.clear();
  last_R_WB_ = newest.now.T_WB.R;
  last_keyframe_at_ = frame.t;
  for (const MeasuredFrame::Track& track : frame.tracks) {
    last_keyframe_[track.id] = {track.has_left, rayInBody(track, *window)};
    if (window->landmarks.count(track.id) || rejected_.count(track.id)) continue;
    std::vector<LandmarkObservation> all;
    for (LandmarkObservation& o : pending_[track.id])
      for (size_t i = 0; i < window->states.size(); ++i)
        if (window->states[i].serial == o.serial) {
          o.state = i;
          all.push_back(o);
        }
    all.push_back(
        {newest.serial, newest_index, track.has_right, track.measurements, track.has_left});
    const int l = views.landmarkCount();
    views.landmark_ids.push_back(track.id);
    for (const LandmarkObservation& o : all)
      for (size_t camera = o.first(); camera < o.end(); ++camera)
        views.measurements.push_back(
            {o.state, l, static_cast<int>(camera), o.measurements[camera]});
    views.first.push_back(views.measurements.size());
    observations.push_back(std::move(all));
  }
  std::vector<SE3> T_WB;
  for (const WindowState& state : window->states) T_WB.push_back(state.seenFrom());
  for (int l = 0; l < views.landmarkCount(); ++l) {
    const LandmarkId id = views.landmark_ids[l];
    const auto p_W = triangulate(views, l, T_WB);
    std::vector<LandmarkObservation>& all = observations[l];
    if (!p_W) {
      pending[id] = std::move(all);
      continue;
    }
    Landmark landmark;
    landmark.id = id;
    landmark.host_serial = newest.serial;
    landmark.host = newest_index;
    landmark.in_host =
        InverseDepthLandmark(newest.seenFrom().inverse() * *p_W, calibration_->cameras[0].T_BC.t);
    landmark.observations = std::move(all);
    landmark.covariance = triangulationCovariance(*window, landmark);
    window->landmarks.emplace(id, std::move(landmark));
  }
  pending_ = std::move(pending);
}

bool Tracks::dropMisfittingImage(const MeasuredFrame& frame, const RelativeViews& views,
                                 Window* window) {
  const WindowState& newest = window->states.back();
  const auto known = [&](const Landmark& landmark) {
    return landmark.seenIn(newest.serial) && landmark.host_serial != newest.serial;
  };
  size_t seen = 0, fitting = 0;
  for (const auto& [id, landmark] : window->landmarks) {
    if (!known(landmark)) continue;
    ++seen;
    fitting += fits(views, views.ray(landmark), landmark.host, landmark.observations.back());
  }
  if (4 * seen < frame.tracks.size() || 4 * fitting >= seen) return false;
  for (auto it = window->landmarks.begin(); it != window->landmarks.end();) {
    Landmark& landmark = it->second;
    if (known(landmark)) landmark.observations.pop_back();
    it = landmark.host_serial == newest.serial ? window->landmarks.erase(it) : std::next(it);
  }
  window->states.back().keyframe = false;
  return true;
}

bool Tracks::fits(const RelativeViews& views, const RelativeViews::Ray& ray, int host,
                  const LandmarkObservation& o, std::array<double, 2>* squares) const {
  for (size_t camera = o.first(); camera < o.end(); ++camera) {
    Eigen::Vector2d r;
    if (!views.residual(ray, host, o, camera, &r) || r.squaredNorm() > options_.chi2_outlier)
      return false;
    if (squares) (*squares)[camera] = r.squaredNorm();
  }
  return true;
}

Tracks::Fit Tracks::dropOutliers(const RelativeViews& views, Window* window) {
  const int newest = window->states.back().serial;
  Fit fit;
  std::vector<double>& squares = fit.squares;
  for (auto it = window->landmarks.begin(); it != window->landmarks.end();) {
    Landmark& landmark = it->second;
    auto& observations = landmark.observations;
    const RelativeViews::Ray ray = views.ray(landmark);
    const size_t before = observations.size(), squares_before = squares.size();
    const auto misfits = [&](const LandmarkObservation& o) {
      std::array<double, 2> r2{};
      if (!fits(views, ray, landmark.host, o, &r2)) return true;
      // What was found again in an old view is whitened by another standard deviation.
      if (!window->states[o.state].retained)
        squares.insert(squares.end(), r2.begin() + o.first(), r2.begin() + o.end());
      return false;
    };
    const bool seen = landmark.seenIn(newest);
    observations.erase(std::remove_if(observations.begin(), observations.end(), misfits),
                       observations.end());
    const bool still_seen = landmark.seenIn(newest);
    if (still_seen)
      landmark.strikes = 0;
    else if (seen)
      ++landmark.strikes;
    fit.used += still_seen && landmark.host_serial != newest;
    // A landmark goes that misses its observations repeatedly, or most of them at once.
    const bool lost =
        observations.empty() || landmark.strikes >= 2 || 2 * observations.size() < before;
    const size_t pixels = squares.size() - squares_before;
    if (lost || !still_seen || observations.size() < 3 || pixels < 3) {
      squares.resize(squares_before);
    } else {
      // Of 2 n coordinates the landmark itself takes three.
      const double share = (2.0 * pixels - 3.0) / (2.0 * pixels);
      for (size_t i = squares_before; i < squares.size(); ++i) squares[i] /= share;
    }
    if (lost) rejected_[landmark.id] = 0;
    it = lost ? window->landmarks.erase(it) : std::next(it);
  }
  return fit;
}

void Tracks::followNoise(std::vector<double> squares, Window* window) const {
  if (squares.size() < 100) return;
  const auto middle = squares.begin() + squares.size() / 2;
  std::nth_element(squares.begin(), middle, squares.end());
  constexpr double kMedian = 1.386;   // of chi-square with 2 degrees of freedom
  constexpr double kFollowed = 0.02;  // a frame: over fifty of them
  double& variance = window->pixel_variance;
  variance += kFollowed * (*middle / kMedian - variance);
  variance = std::max(variance, std::pow(options_.least_sigma_px / options_.sigma_px, 2));
}

}  // namespace etalon::fixed_lag
