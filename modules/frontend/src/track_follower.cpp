#include "track_follower.h"

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <utility>

namespace etalon {

namespace {

StereoInertialCalibration exchanged(StereoInertialCalibration calibration) {
  std::swap(calibration.cameras[0], calibration.cameras[1]);
  return calibration;
}

/** Where the rotation alone takes a pixel; the pixel itself if it leaves the image. */
cv::Point2f rotated(const CameraModel& camera, const cv::Point2f& pixel,
                    const Eigen::Matrix3d& R_cur_prev) {
  const auto ray = camera.unproject({pixel.x, pixel.y});
  if (!ray) return pixel;
  const auto moved = camera.project(R_cur_prev * *ray);
  if (!moved || !camera.inImage(*moved)) return pixel;
  return {static_cast<float>(moved->x()), static_cast<float>(moved->y())};
}

}  // namespace

TrackFollower::TrackFollower(const StereoInertialCalibration& calibration,
                             const StereoTrackerOptions& options)
    : rigs_{calibration, exchanged(calibration)}, options_(options) {}

Eigen::Matrix3d TrackFollower::ofCamera(size_t c, const Eigen::Matrix3d& R_prev_cur) const {
  const Eigen::Matrix3d& R_BC = rigs_[c].cameras[0].T_BC.R;
  return R_BC.transpose() * R_prev_cur.transpose() * R_BC;
}

/** Where the track's anchor fits near `pixel`, if it does. */
std::optional<PatchPose> TrackFollower::anchored(const Track& track, const Eigen::Matrix2d& A,
                                                 const cv::Point2f& pixel,
                                                 const cv::Mat& image) const {
  const Eigen::Vector2d followed(pixel.x, pixel.y);
  PatchPose pose{followed, A};
  const double correlation =
      track.anchor.align(image, &pose, options_.anchor_iterations, options_.anchor_epsilon_px);
  const double scale = pose.A.determinant();
  if (correlation >= options_.anchor_min_correlation &&
      (pose.centre - followed).norm() <= options_.anchor_reach_px && scale > 0.3 && scale < 3.0)
    return pose;
  return std::nullopt;
}

/** KLT of the wanted tracks from a previous image of camera `c` to its present one, and their
 * anchors there. */
TrackFollower::Followed TrackFollower::followIn(size_t c, const Pyramid& before, const Pyramid& now,
                                                const cv::Mat& image,
                                                const std::vector<Track>& tracks,
                                                const Followed& wanted,
                                                const Eigen::Matrix3d& R_prev_cur) const {
  const CameraModel& camera = rigs_[c].cameras[0].model;
  const Eigen::Matrix3d R_cur_prev = ofCamera(c, R_prev_cur);
  std::vector<cv::Point2f> to;
  for (const cv::Point2f& pixel : wanted.from) to.push_back(rotated(camera, pixel, R_cur_prev));
  const std::vector<char> good = followPoints(before, now, wanted.from, &to, options_);
  Followed found;
  for (size_t i = 0; i < good.size(); ++i) {
    if (!good[i] || !camera.inImage({to[i].x, to[i].y}, options_.border_px)) continue;
    const Track& track = tracks[wanted.tracks[i]];
    found.tracks.push_back(wanted.tracks[i]);
    found.from.push_back(wanted.from[i]);
    found.to.push_back(to[i]);
    found.anchored.push_back(
        anchored(track, c == followed_ ? track.A : track.A_other, to[i], image));
    found.fitting += found.anchored.back().has_value();
  }
  return found;
}

void TrackFollower::follow(const std::array<const cv::Mat*, 2>& images,
                           const Eigen::Matrix3d& R_prev_cur, std::vector<Track>* tracks) {
  constexpr double kMost = 0.3;  // of the anchors fit
  Pyramid now = buildPyramid(*images[followed_], options_);
  Followed all, matched;
  for (size_t i = 0; i < tracks->size(); ++i) {
    const Track& track = (*tracks)[i];
    all.tracks.push_back(i);
    all.from.push_back(track.pixel);
    if (track.inverse_depth < 0.0) continue;
    matched.tracks.push_back(i);
    matched.from.push_back(track.matched);
  }
  Followed found = followIn(followed_, pyramid_, now, *images[followed_], *tracks, all, R_prev_cur);
  if (static_cast<double>(found.fitting) < kMost * static_cast<double>(tracks->size()) &&
      matched.tracks.size() > found.fitting) {
    const size_t other = 1 - followed_;
    Pyramid other_now = buildPyramid(*images[other], options_);
    Followed in_other = followIn(other, buildPyramid(other_, options_), other_now, *images[other],
                                 *tracks, matched, R_prev_cur);
    if (in_other.fitting > found.fitting) {
      for (const size_t i : in_other.tracks) exchangeCameras(&(*tracks)[i]);
      followed_ = other;
      found = std::move(in_other);
      now = std::move(other_now);
    }
  }
  take(found, *images[followed_], tracks);
  pyramid_ = std::move(now);
  images[1 - followed_]->copyTo(other_);
}

/** Keeps the tracks that were found, where they were, but for those that have left the lens. */
void TrackFollower::take(const Followed& found, const cv::Mat& image,
                         std::vector<Track>* tracks) const {
  constexpr double kWornScale = 1.5;  // of the patch's area
  std::vector<Track> kept;
  for (size_t i = 0; i < found.tracks.size(); ++i) {
    Track& track = (*tracks)[found.tracks[i]];
    track.pixel_before = found.from[i];
    track.pixel = found.to[i];
    if (const auto& pose = found.anchored[i]) {
      track.pixel = {static_cast<float>(pose->centre.x()), static_cast<float>(pose->centre.y())};
      track.A = pose->A;
      track.unanchored = 0;
      const double scale = pose->A.determinant();
      if (scale > kWornScale || scale < 1.0 / kWornScale) renewAnchor(image, &track);
    } else if (++track.unanchored > options_.anchor_patience) {
      continue;
    }
    if (!rig().cameras[0].model.unproject({track.pixel.x, track.pixel.y})) continue;
    kept.push_back(std::move(track));
  }
  tracks->swap(kept);
}

/** What is known of a matched track, in the camera that is not followed yet. */
void TrackFollower::exchangeCameras(Track* track) const {
  const auto ray = rig().cameras[0].model.unproject({track->pixel.x, track->pixel.y});
  const auto other_ray = rig().cameras[1].model.unproject({track->matched.x, track->matched.y});
  if (ray && other_ray) {
    const SE3 T = rig().rightFromLeft();
    const Eigen::Vector3d scaled = T.R * *ray + track->inverse_depth * T.t;
    track->inverse_depth *= other_ray->norm() / scaled.norm();
  } else {
    track->inverse_depth = -1.0;
  }
  std::swap(track->A, track->A_other);
}

/** A new anchor where the view has changed in scale, while the old one still fits: it is the same
 * point. */
void TrackFollower::renewAnchor(const cv::Mat& image, Track* track) const {
  AnchorPatch anchor(image, {track->pixel.x, track->pixel.y}, options_.anchor_window_px);
  if (!anchor.valid()) return;
  track->anchor = std::move(anchor);
  track->A_other = (track->A_other * track->A.inverse()).eval();
  track->A.setIdentity();
}

}  // namespace etalon
