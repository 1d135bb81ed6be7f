#include "etalon/frontend/stereo_tracker.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <opencv2/imgproc.hpp>
#include <string>
#include <utility>

#include "corner_grid.h"
#include "etalon/core/errors.h"
#include "etalon/core/stopwatch.h"
#include "etalon/core/text.h"
#include "etalon/frontend/anchor_patch.h"
#include "motion_check.h"
#include "stereo_matcher.h"
#include "track_follower.h"

namespace etalon {

namespace {

/** The options with which the tracker begins. */
const StereoTrackerOptions& checked(const StereoTrackerOptions& options,
                                    const StereoInertialCalibration& calibration) {
  const CameraModel &left = calibration.cameras[0].model, &right = calibration.cameras[1].model;
  if (left.width() != right.width() || left.height() != right.height())
    throw ConfigError(
        format("the calibration has images of %dx%d (cam0) and %dx%d pixels (cam1): "
               "expected two cameras of one size",
               left.width(), left.height(), right.width(), right.height()));
  for (const auto& [key, side] : {std::pair("klt_window_px", options.klt_window_px),
                                  std::pair("anchor_window_px", options.anchor_window_px)})
    if (side % 2 == 0)
      throw ConfigError(std::string("[frontend] ") + key + " = " + std::to_string(side) +
                        ": expected an odd integer");
  return options;
}

}  // namespace

class StereoTracker::Impl {
 public:
  Impl(const StereoInertialCalibration& calibration, const StereoTrackerOptions& options)
      : options_(checked(options, calibration)),
        follower_(calibration, options_),
        matchers_{StereoMatcher(follower_.rig(0), options_),
                  StereoMatcher(follower_.rig(1), options_)} {}

  TrackedFrame track(TimeNs t, const cv::Mat& left, const cv::Mat& right,
                     const Eigen::Matrix3d& R_prev_cur, bool in_flight) {
    Stopwatch watch;
    statistics_ = TrackingStatistics();
    checkImage(left, 0);
    checkImage(right, 1);
    const std::array<const cv::Mat*, 2> images = {&left, &right};
    const int before = tracks_.size();
    follower_.follow(images, R_prev_cur, &tracks_);
    const size_t followed = follower_.followed();
    const cv::Mat &image = *images[followed], &other = *images[1 - followed];
    rejectByMotion(follower_.ofCamera(R_prev_cur));
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
    TrackedFrame frame = observe(t, other);
    statistics_.milliseconds = watch.lapMilliseconds();
    return frame;
  }

  const TrackingStatistics& statistics() const { return statistics_; }

 private:
  const CameraModel& camera() const { return follower_.rig().cameras[0].model; }

  void checkImage(const cv::Mat& image, size_t camera) const {
    const CameraModel& model = follower_.rig(0).cameras[camera].model;
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
    for (const auto& offset :
         {Eigen::Vector2d(0.0, 0.0), Eigen::Vector2d(d, d), Eigen::Vector2d(d, -d),
          Eigen::Vector2d(-d, d), Eigen::Vector2d(-d, -d)})
      if (!camera().unproject(centre + offset)) return false;
    return true;
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

  /** Of tracks that have run into each other the oldest survives. */
  void keepApart(CornerGrid* grid) {
    std::vector<Track> kept;
    for (Track& track : tracks_)  // in the order of their ids
      if (grid->claim(track.pixel)) kept.push_back(std::move(track));
    tracks_.swap(kept);
  }

  /** What is reported of the frame: tracks that their anchors fit, matched with the other image. */
  TrackedFrame observe(TimeNs t, const cv::Mat& other) {
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
      query.left_ray = camera().unproject({track.pixel.x, track.pixel.y}).value();
      queries.push_back(query);
      anchored.push_back(&track);
    }
    cv::Mat half, other_half;
    // KLT's pyramid ends where a level would be no larger than its window.
    if (const Pyramid& pyramid = follower_.pyramid(); pyramid.size() > 2)
      half = pyramid[2];
    else
      cv::pyrDown(pyramid[0], half);
    cv::pyrDown(other, other_half);
    const size_t followed = follower_.followed();
    const std::vector<StereoMatch> matches =
        matchers_[followed].match(half, other, other_half, queries);
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
      pixels[followed] = {track.pixel.x, track.pixel.y};
      pixels[1 - followed] = {track.matched.x, track.matched.y};
      if (followed == 0 || matches[i].found)
        frame.observations.push_back({track.id, pixels[0], pixels[1], matches[i].found});
      else
        frame.right_only.push_back({track.id, pixels[1]});
    }
    return frame;
  }

  StereoTrackerOptions options_;
  TrackFollower follower_;
  std::array<StereoMatcher, 2> matchers_;  ///< by the camera that is followed
  TrackingStatistics statistics_;
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
