#include "etalon/frontend/stereo_tracker.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <opencv2/imgproc.hpp>
#include <optional>

#include "corner_grid.h"
#include "etalon/core/errors.h"
#include "etalon/core/stopwatch.h"
#include "etalon/frontend/anchor_patch.h"
#include "klt.h"
#include "motion_check.h"
#include "stereo_matcher.h"

namespace etalon {

class StereoTracker::Impl {
 public:
  /** In the image of the camera that is followed; the "other" image is of the other camera. */
  struct Track {
    LandmarkId id = -1;
    cv::Point2f pixel;
    cv::Point2f pixel_before{};  ///< in the frame before
    cv::Point2f matched{};  ///< in the other image of the last frame, if inverse_depth is known
    double inverse_depth = -1.0;  ///< 1/m, in the camera that is followed; negative if not matched
    AnchorPatch anchor{};         ///< what it looked like when it was found
    Eigen::Matrix2d A = Eigen::Matrix2d::Identity();        ///< of the anchor in the current image
    Eigen::Matrix2d A_other = Eigen::Matrix2d::Identity();  ///< in the other one
    int unanchored = 0;  ///< frames in a row in which the anchor did not fit
    int unmatched = 0;   ///< frames in a row without a match in the other image
  };

  Impl(const StereoInertialCalibration& calibration, const StereoTrackerOptions& options)
      : rigs_{calibration, exchanged(calibration)},
        options_(options),
        matchers_{StereoMatcher(rigs_[0], options_), StereoMatcher(rigs_[1], options_)} {}

  TrackedFrame track(TimeNs t, const cv::Mat& left, const cv::Mat& right,
                     const Eigen::Matrix3d& R_prev_cur, bool in_flight) {
    Stopwatch watch;
    statistics_ = TrackingStatistics();
    checkImage(left, 0);
    checkImage(right, 1);
    const std::array<const cv::Mat*, 2> images = {&left, &right};
    const int before = tracks_.size();
    Pyramid pyramid = follow(images, R_prev_cur);
    const cv::Mat &image = *images[followed_], &other = *images[1 - followed_];
    cv::Mat other_half;
    cv::pyrDown(other, other_half);
    rejectByMotion(ofCamera(rigs_[followed_], R_prev_cur));
    StereoTrackerOptions options = options_;
    if (in_flight) options.max_features = std::min(options.flight_features, options.max_features);
    CornerGrid grid(image.size(), options);
    keepApart(&grid);
    statistics_.tracked = tracks_.size();
    statistics_.lost = before - statistics_.tracked;
    for (const cv::Point2f& corner :
         grid.detect(image, options.max_features - statistics_.tracked)) {
      if (!inLens(corner)) continue;
      AnchorPatch anchor(image, {corner.x, corner.y}, options_.anchor_window_px);
      if (!anchor.valid()) continue;
      tracks_.push_back({next_id_++, corner});
      tracks_.back().anchor = std::move(anchor);
      ++statistics_.added;
    }
    TrackedFrame frame = observe(t, pyramid, other, other_half);
    previous_ = std::move(pyramid);
    other.copyTo(previous_other_);
    statistics_.milliseconds = watch.lapMilliseconds();
    return frame;
  }

  const TrackingStatistics& statistics() const { return statistics_; }

 private:
  static StereoInertialCalibration exchanged(StereoInertialCalibration calibration) {
    std::swap(calibration.cameras[0], calibration.cameras[1]);
    return calibration;
  }

  /** Rotation of the camera that `rig` has first, from the previous frame's axes to this one's. */
  static Eigen::Matrix3d ofCamera(const StereoInertialCalibration& rig,
                                  const Eigen::Matrix3d& R_prev_cur) {
    const Eigen::Matrix3d& R_BC = rig.cameras[0].T_BC.R;
    return R_BC.transpose() * R_prev_cur.transpose() * R_BC;
  }

  const CameraModel& camera() const { return rigs_[followed_].cameras[0].model; }

  void checkImage(const cv::Mat& image, size_t camera) const {
    const CameraModel& model = rigs_[0].cameras[camera].model;
    if (image.type() == CV_8UC1 && image.cols == model.width() && image.rows == model.height())
      return;
    throw DataError("", 0,
                    "image of camera " + std::to_string(camera) + ": expected 8-bit gray of " +
                        std::to_string(model.width()) + " x " + std::to_string(model.height()) +
                        " px, got " + std::to_string(image.cols) + " x " +
                        std::to_string(image.rows) + ", OpenCV type " +
                        std::to_string(image.type()));
  }

  /** Whether the lens shows something around the pixel, as far as landmarks keep off the edge. */
  bool inLens(const cv::Point2f& pixel) const {
    const double d = options_.border_px;
    const Eigen::Vector2d centre(pixel.x, pixel.y);
    for (const auto& offset : {Eigen::Vector2d(d, d), Eigen::Vector2d(d, -d),
                               Eigen::Vector2d(-d, d), Eigen::Vector2d(-d, -d)})
      if (!camera().unproject(centre + offset)) return false;
    return true;
  }

  /** Where the rotation alone takes a pixel; the pixel itself if it leaves the image. */
  static cv::Point2f rotated(const CameraModel& camera, const cv::Point2f& pixel,
                             const Eigen::Matrix3d& R_cur_prev) {
    const auto ray = camera.unproject({pixel.x, pixel.y});
    if (!ray) return pixel;
    const auto moved = camera.project(R_cur_prev * *ray);
    if (!moved || !camera.inImage(*moved)) return pixel;
    return {static_cast<float>(moved->x()), static_cast<float>(moved->y())};
  }

  /** Tracks found again in an image. */
  struct Followed {
    std::vector<size_t> tracks;
    std::vector<cv::Point2f> from, to;
    std::vector<std::optional<PatchPose>> anchored;  ///< where the track's anchor fits
    size_t fitting = 0;                              ///< tracks that are anchored
  };

  /** KLT of tracks from a previous image of camera `c` to its present one, and what it has drifted
   * since the tracks' anchors taken back. */
  Followed followIn(size_t c, const Pyramid& before, const Pyramid& now, const cv::Mat& image,
                    const Followed& wanted, const Eigen::Matrix3d& R_prev_cur) const {
    const CameraModel& camera = rigs_[c].cameras[0].model;
    const Eigen::Matrix3d R_cur_prev = ofCamera(rigs_[c], R_prev_cur);
    std::vector<cv::Point2f> to;
    for (const cv::Point2f& pixel : wanted.from) to.push_back(rotated(camera, pixel, R_cur_prev));
    const std::vector<char> good = followPoints(before, now, wanted.from, &to, options_);
    Followed found;
    for (size_t i = 0; i < good.size(); ++i) {
      if (!good[i] || !camera.inImage({to[i].x, to[i].y}, options_.border_px)) continue;
      const Track& track = tracks_[wanted.tracks[i]];
      found.tracks.push_back(wanted.tracks[i]);
      found.from.push_back(wanted.from[i]);
      found.to.push_back(to[i]);
      found.anchored.push_back(
          anchored(track, c == followed_ ? track.A : track.A_other, to[i], image));
      found.fitting += found.anchored.back().has_value();
    }
    return found;
  }

  /** Where the track's anchor fits near `pixel`, if it does. */
  std::optional<PatchPose> anchored(const Track& track, const Eigen::Matrix2d& A,
                                    const cv::Point2f& pixel, const cv::Mat& image) const {
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

  /**
   * Follows the tracks from the previous frame. Those that KLT loses are dropped, and so are those
   * that their anchors do not fit any more: with new anchors they would be other points, which
   * earlier sightings are not of. Where most anchors do not fit in the image of the camera that is
   * followed and more do in the other one's, as with a covered lens, that one is followed from here
   * on.
   * @return the pyramid of the image that is followed
   */
  Pyramid follow(const std::array<const cv::Mat*, 2>& images, const Eigen::Matrix3d& R_prev_cur) {
    constexpr double kMost = 0.3;       // of the anchors fit
    constexpr double kWornScale = 1.5;  // of the patch's area
    Pyramid pyramid = buildPyramid(*images[followed_], options_);
    Followed all, matched;
    for (size_t i = 0; i < tracks_.size(); ++i) {
      all.tracks.push_back(i);
      all.from.push_back(tracks_[i].pixel);
      if (tracks_[i].inverse_depth < 0.0) continue;
      matched.tracks.push_back(i);
      matched.from.push_back(tracks_[i].matched);
    }
    Followed found = followIn(followed_, previous_, pyramid, *images[followed_], all, R_prev_cur);
    if (static_cast<double>(found.fitting) < kMost * static_cast<double>(tracks_.size()) &&
        matched.tracks.size() > found.fitting) {
      const size_t other = 1 - followed_;
      Pyramid other_pyramid = buildPyramid(*images[other], options_);
      Followed in_other = followIn(other, buildPyramid(previous_other_, options_), other_pyramid,
                                   *images[other], matched, R_prev_cur);
      if (in_other.fitting > found.fitting) {
        for (const size_t i : in_other.tracks) exchangeCameras(&tracks_[i]);
        followed_ = other;
        found = std::move(in_other);
        pyramid = std::move(other_pyramid);
      }
    }
    std::vector<Track> kept;
    for (size_t i = 0; i < found.tracks.size(); ++i) {
      Track& track = tracks_[found.tracks[i]];
      track.pixel_before = found.from[i];
      track.pixel = found.to[i];
      if (const auto& pose = found.anchored[i]) {
        track.pixel = {static_cast<float>(pose->centre.x()), static_cast<float>(pose->centre.y())};
        track.A = pose->A;
        track.unanchored = 0;
        const double scale = pose->A.determinant();
        if (scale > kWornScale || scale < 1.0 / kWornScale) renewAnchor(*images[followed_], &track);
      } else if (++track.unanchored > options_.anchor_patience) {
        continue;
      }
      kept.push_back(std::move(track));
    }
    tracks_.swap(kept);
    return pyramid;
  }

  /** What is known of a matched track, in the camera that is not followed yet. */
  void exchangeCameras(Track* track) const {
    const StereoInertialCalibration& rig = rigs_[followed_];
    const auto ray = camera().unproject({track->pixel.x, track->pixel.y});
    const auto other_ray = rig.cameras[1].model.unproject({track->matched.x, track->matched.y});
    if (ray && other_ray) {
      const SE3 T = rig.rightFromLeft();
      const Eigen::Vector3d scaled = T.R * *ray + track->inverse_depth * T.t;
      track->inverse_depth *= other_ray->norm() / scaled.norm();
    } else {
      track->inverse_depth = -1.0;
    }
    std::swap(track->A, track->A_other);
  }

  /** Drops tracks that do not move as the camera does. */
  void rejectByMotion(const Eigen::Matrix3d& R_cur_prev) {
    if (options_.temporal_epipolar_px <= 0.0) return;
    const CameraModel& camera = this->camera();
    std::vector<TrackedRay> rays;
    std::vector<size_t> index;
    for (size_t i = 0; i < tracks_.size(); ++i) {
      const Track& track = tracks_[i];
      const auto before = camera.unproject({track.pixel_before.x, track.pixel_before.y});
      const auto now = camera.measure({track.pixel.x, track.pixel.y});
      if (!before || !now) continue;
      rays.push_back({*before, *now, track.inverse_depth});
      index.push_back(i);
    }
    const std::vector<char> agree = agreeWithMotion(rays, R_cur_prev, 0.5 * camera.focal().sum(),
                                                    options_.temporal_epipolar_px);
    std::vector<char> keep(tracks_.size(), 1);
    for (size_t j = 0; j < index.size(); ++j) keep[index[j]] = agree[j];
    std::vector<Track> kept;
    for (size_t i = 0; i < tracks_.size(); ++i)
      if (keep[i]) kept.push_back(std::move(tracks_[i]));
    tracks_.swap(kept);
  }

  /** A new anchor where the view has changed in scale, while the old one still fits: it is the same
   * point. */
  void renewAnchor(const cv::Mat& image, Track* track) const {
    AnchorPatch anchor(image, {track->pixel.x, track->pixel.y}, options_.anchor_window_px);
    if (!anchor.valid()) return;
    track->anchor = std::move(anchor);
    track->A_other = (track->A_other * track->A.inverse()).eval();
    track->A.setIdentity();
  }

  /** Of tracks that have run into each other the oldest survives. */
  void keepApart(CornerGrid* grid) {
    std::vector<Track> kept;
    for (Track& track : tracks_)  // in the order of their ids
      if (grid->claim(track.pixel)) kept.push_back(std::move(track));
    tracks_.swap(kept);
  }

  /** What is reported of the frame: tracks that their anchors fit, matched with the other image.
   */
  TrackedFrame observe(TimeNs t, const Pyramid& pyramid, const cv::Mat& other,
                       const cv::Mat& other_half) {
    // What is not found along the whole curve is hidden or repeats itself, and is sought less often,
    // unless it is the whole image that showed nothing.
    constexpr int kSearches = 1, kSearchPeriod = 4;  // frames
    const auto matched = std::count_if(tracks_.begin(), tracks_.end(),
                                       [](const Track& track) { return track.unmatched == 0; });
    const bool search_all = 4 * matched < static_cast<std::ptrdiff_t>(tracks_.size());
    std::vector<Track*> anchored;
    std::vector<StereoQuery> queries;
    for (Track& track : tracks_) {
      if (track.unanchored > 0) {
        track.inverse_depth = -1.0;
        continue;
      }
      StereoQuery query;
      query.left = track.pixel;
      query.inverse_depth = track.inverse_depth;
      query.search =
          search_all || track.unmatched <= kSearches || track.unmatched % kSearchPeriod == 0;
      query.patch = &track.anchor;
      query.A = track.A_other;
      const auto ray = camera().unproject({track.pixel.x, track.pixel.y});
      if (ray) query.left_ray = *ray;
      queries.push_back(query);
      anchored.push_back(&track);
    }
    const std::vector<StereoMatch> matches =
        matchers_[followed_].match(pyramid[2], other, other_half, queries);
    TrackedFrame frame;
    frame.t = t;
    for (size_t i = 0; i < anchored.size(); ++i) {
      Track& track = *anchored[i];
      track.A_other = matches[i].found ? matches[i].A : track.A;
      track.inverse_depth = matches[i].inverse_depth;  // unknown again where the match failed
      track.matched = matches[i].right;
      track.unmatched = matches[i].found ? 0 : track.unmatched + 1;
      statistics_.with_stereo += matches[i].found;
      std::array<Eigen::Vector2d, 2> pixels;
      pixels[followed_] = {track.pixel.x, track.pixel.y};
      pixels[1 - followed_] = {track.matched.x, track.matched.y};
      if (followed_ == 0 || matches[i].found)
        frame.observations.push_back({track.id, pixels[0], pixels[1], matches[i].found});
      else
        frame.right_only.push_back({track.id, pixels[1]});
    }
    return frame;
  }

  std::array<StereoInertialCalibration, 2> rigs_;  ///< the second: with the cameras exchanged
  StereoTrackerOptions options_;
  std::array<StereoMatcher, 2> matchers_;  ///< of the rigs
  TrackingStatistics statistics_;
  size_t followed_ = 0;  ///< the camera whose image the tracks are in
  Pyramid previous_;
  cv::Mat previous_other_;
  std::vector<Track> tracks_;  ///< in increasing order of id
  LandmarkId next_id_ = 0;
};

StereoTracker::StereoTracker(const StereoInertialCalibration& calibration,
                             const StereoTrackerOptions& options)
    : impl_(std::make_unique<Impl>(calibration, options)) {}

StereoTracker::~StereoTracker() = default;

TrackedFrame StereoTracker::track(TimeNs t, const cv::Mat& left, const cv::Mat& right,
                                  const Eigen::Matrix3d& R_prev_cur, bool in_flight) {
  return impl_->track(t, left, right, R_prev_cur, in_flight);
}

const TrackingStatistics& StereoTracker::statistics() const { return impl_->statistics(); }

}  // namespace etalon
