#include "etalon/frontend/stereo_tracker.h"

#include <Eigen/Geometry>
#include <opencv2/imgproc.hpp>

#include "anchor_patch.h"
#include "corner_grid.h"
#include "etalon/core/errors.h"
#include "etalon/core/stopwatch.h"
#include "klt.h"
#include "motion_check.h"
#include "stereo_matcher.h"

namespace etalon {

void StereoTrackerOptions::declare(ParameterSet& parameters) {
  parameters.add("max_features", &max_features, {10, 5000}, "Landmarks followed at a time.");
  parameters.add("klt_window_px", &klt_window_px, {5, 63}, "Side of the KLT patch, px (odd).");
  parameters.add("klt_levels", &klt_levels, {1, 8}, "Pyramid levels above the full image.");
  parameters.add("klt_iterations", &klt_iterations, {1, 1000}, "KLT iterations a level, at most.");
  parameters.add("klt_epsilon_px", &klt_epsilon_px, {1e-6, 1.0},
                 "A KLT iteration that moves less ends the level, px.");
  parameters.add("forward_backward_px", &forward_backward_px, {0.01, 100.0},
                 "A track followed back must end this near to where it started, px.");
  parameters.add("epipolar_px", &epipolar_px, {0.01, 100.0},
                 "Largest distance of a right pixel from its epipolar line, px.");
  parameters.add("temporal_epipolar_px", &temporal_epipolar_px, {0.0, 100.0},
                 "Largest distance of a track from where the camera's motion since the last frame "
                 "takes its landmark (from its epipolar line where the depth is unknown), px; 0: "
                 "no such check.");
  parameters.add("min_distance_px", &min_distance_px, {1.0, 200.0},
                 "Least distance between two landmarks, px.");
  parameters.add("min_corner_response", &min_corner_response, {0.0, 1.0},
                 "A corner's least eigenvalue of the structure tensor (OpenCV's "
                 "cornerMinEigenVal, block 5) is at least this.");
  parameters.add("min_depth_m", &min_depth_m, {0.01, 100.0},
                 "Landmarks nearer to the camera are not matched between left and right, m.");
  parameters.add("min_correlation", &min_correlation, {-1.0, 1.0},
                 "Normalised correlation that a patch must reach in the right image.");
  parameters.add("anchor_window_px", &anchor_window_px, {7, 63},
                 "Side of the patch that a track keeps from its first frame and is aligned with in "
                 "later left and right images, px (odd).");
  parameters.add("anchor_iterations", &anchor_iterations, {1, 1000},
                 "Iterations of that alignment, at most.");
  parameters.add("anchor_reach_px", &anchor_reach_px, {0.01, 100.0},
                 "The alignment corrects a track by at most this, px.");
  parameters.add("anchor_min_correlation", &anchor_min_correlation, {-1.0, 1.0},
                 "Normalised correlation that an aligned patch must reach in the left image.");
  parameters.add(
      "anchor_patience", &anchor_patience, {0, 1000},
      "A track ends where its patch cannot be aligned in more frames in a row than this; "
      "in such a frame it is not observed.");
  parameters.add("stereo_reach_px", &stereo_reach_px, {0.0, 100.0},
                 "A right pixel is at most this far from where the search or the last depth "
                 "expects it, px.");
  parameters.add("border_px", &border_px, {1, 200},
                 "No landmark is nearer to the edge of the image, px.");
}

namespace {

struct Track {
  LandmarkId id = -1;
  cv::Point2f pixel;
  cv::Point2f pixel_before{};   ///< in the frame before
  double inverse_depth = -1.0;  ///< 1/m when last matched with the right image; negative if never
  AnchorPatch anchor{};         ///< what it looked like when it was found
  Eigen::Matrix2d A = Eigen::Matrix2d::Identity();        ///< of the anchor in the current image
  Eigen::Matrix2d A_right = Eigen::Matrix2d::Identity();  ///< in the right one
  int unanchored = 0;  ///< frames in a row in which the anchor did not fit
};

}  // namespace

class StereoTracker::Impl {
 public:
  Impl(const StereoInertialCalibration& calibration, const StereoTrackerOptions& options)
      : calibration_(calibration), options_(options), matcher_(calibration_, options_) {}

  TrackedFrame track(TimeNs t, const cv::Mat& left, const cv::Mat& right,
                     const Eigen::Matrix3d& R_prev_cur) {
    Stopwatch watch;
    statistics_ = TrackingStatistics();
    checkImage(left, 0);
    checkImage(right, 1);
    Pyramid left_pyramid = buildPyramid(left, options_);
    cv::Mat right_half;
    cv::pyrDown(right, right_half);
    const int before = static_cast<int>(tracks_.size());
    const Eigen::Matrix3d& R_BC0 = calibration_.cameras[0].T_BC.R;
    const Eigen::Matrix3d R_C0cur_C0prev = R_BC0.transpose() * R_prev_cur.transpose() * R_BC0;
    follow(left_pyramid, R_C0cur_C0prev);
    anchorTracks(left);
    rejectByMotion(R_C0cur_C0prev);
    CornerGrid grid(left.size(), options_);
    keepApart(&grid);
    statistics_.tracked = static_cast<int>(tracks_.size());
    statistics_.lost = before - statistics_.tracked;
    for (const cv::Point2f& corner :
         grid.detect(left, options_.max_features - statistics_.tracked)) {
      if (!inLens(corner)) continue;
      AnchorPatch anchor(left, {corner.x, corner.y}, options_.anchor_window_px);
      if (!anchor.valid()) continue;
      tracks_.push_back({next_id_++, corner});
      tracks_.back().anchor = std::move(anchor);
      ++statistics_.added;
    }
    TrackedFrame frame = observe(t, left_pyramid, right, right_half);
    previous_ = std::move(left_pyramid);
    statistics_.milliseconds = watch.lapMilliseconds();
    return frame;
  }

  const TrackingStatistics& statistics() const { return statistics_; }

 private:
  void checkImage(const cv::Mat& image, size_t camera) const {
    const CameraModel& model = calibration_.cameras[camera].model;
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
      if (!calibration_.cameras[0].model.unproject(centre + offset)) return false;
    return true;
  }

  /** Where the rotation alone takes a pixel of the left image; the pixel itself if it leaves the
   * image. */
  cv::Point2f rotated(const cv::Point2f& pixel, const Eigen::Matrix3d& R_C0cur_C0prev) const {
    const CameraModel& camera = calibration_.cameras[0].model;
    const auto ray = camera.unproject({pixel.x, pixel.y});
    if (!ray) return pixel;
    const auto moved = camera.project(R_C0cur_C0prev * *ray);
    if (!moved || !camera.inImage(*moved)) return pixel;
    return {static_cast<float>(moved->x()), static_cast<float>(moved->y())};
  }

  /** KLT from the previous left image; tracks that fail are dropped. */
  void follow(const Pyramid& left, const Eigen::Matrix3d& R_C0cur_C0prev) {
    if (tracks_.empty()) return;
    std::vector<cv::Point2f> from, to;
    for (const Track& track : tracks_) {
      from.push_back(track.pixel);
      to.push_back(rotated(track.pixel, R_C0cur_C0prev));
    }
    std::vector<char> good = followPoints(previous_, left, from, &to, options_);
    for (size_t i = 0; i < good.size(); ++i)
      good[i] =
          good[i] && calibration_.cameras[0].model.inImage({to[i].x, to[i].y}, options_.border_px);
    std::vector<Track> kept;
    for (size_t i = 0; i < tracks_.size(); ++i)
      if (good[i]) {
        kept.push_back(std::move(tracks_[i]));
        kept.back().pixel_before = from[i];
        kept.back().pixel = to[i];
      }
    tracks_.swap(kept);
  }

  /** Drops tracks that do not move as the camera does. */
  void rejectByMotion(const Eigen::Matrix3d& R_C0cur_C0prev) {
    if (options_.temporal_epipolar_px <= 0.0) return;
    const CameraModel& camera = calibration_.cameras[0].model;
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
    const std::vector<char> agree = agreeWithMotion(
        rays, R_C0cur_C0prev, 0.5 * camera.focal().sum(), options_.temporal_epipolar_px);
    std::vector<char> keep(tracks_.size(), 1);
    for (size_t j = 0; j < index.size(); ++j) keep[index[j]] = agree[j];
    std::vector<Track> kept;
    for (size_t i = 0; i < tracks_.size(); ++i)
      if (keep[i]) kept.push_back(std::move(tracks_[i]));
    tracks_.swap(kept);
  }

  /**
   * Takes back what the tracks have drifted since their anchors. A track that its anchor does not
   * fit any more ends: with a new anchor it would be another point, which earlier sightings are not
   * of.
   */
  void anchorTracks(const cv::Mat& left) {
    std::vector<Track> kept;
    for (Track& track : tracks_) {
      const Eigen::Vector2d followed(track.pixel.x, track.pixel.y);
      PatchPose pose{followed, track.A};
      const double correlation =
          track.anchor.align(left, &pose, options_.anchor_iterations, options_.klt_epsilon_px);
      const double scale = pose.A.determinant();
      if (correlation >= options_.anchor_min_correlation &&
          (pose.centre - followed).norm() <= options_.anchor_reach_px && scale > 0.3 &&
          scale < 3.0) {
        track.pixel = {static_cast<float>(pose.centre.x()), static_cast<float>(pose.centre.y())};
        track.A = pose.A;
        track.unanchored = 0;
      } else if (++track.unanchored > options_.anchor_patience) {
        continue;
      }
      kept.push_back(std::move(track));
    }
    tracks_.swap(kept);
  }

  /** Of tracks that have run into each other the oldest survives. */
  void keepApart(CornerGrid* grid) {
    std::vector<Track> kept;
    for (Track& track : tracks_)  // in the order of their ids
      if (grid->claim(track.pixel)) kept.push_back(std::move(track));
    tracks_.swap(kept);
  }

  /** What is reported of the frame: tracks that their anchors fit, with their right pixels. */
  TrackedFrame observe(TimeNs t, const Pyramid& left_pyramid, const cv::Mat& right,
                       const cv::Mat& right_half) {
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
      query.patch = &track.anchor;
      query.A = track.A_right;
      const auto ray = calibration_.cameras[0].model.unproject({track.pixel.x, track.pixel.y});
      if (ray) query.left_ray = *ray;
      queries.push_back(query);
      anchored.push_back(&track);
    }
    const std::vector<StereoMatch> matches =
        matcher_.match(left_pyramid[2], right, right_half, queries);
    TrackedFrame frame;
    frame.t = t;
    for (size_t i = 0; i < anchored.size(); ++i) {
      Track& track = *anchored[i];
      Observation o;
      o.id = track.id;
      o.left = {track.pixel.x, track.pixel.y};
      o.has_right = matches[i].found;
      if (o.has_right) o.right = {matches[i].right.x, matches[i].right.y};
      track.A_right = o.has_right ? matches[i].A : track.A;
      track.inverse_depth = matches[i].inverse_depth;  // unknown again where the match failed
      statistics_.with_stereo += o.has_right;
      frame.observations.push_back(o);
    }
    return frame;
  }

  StereoInertialCalibration calibration_;
  StereoTrackerOptions options_;
  StereoMatcher matcher_;
  TrackingStatistics statistics_;
  Pyramid previous_;
  std::vector<Track> tracks_;  ///< in increasing order of id
  LandmarkId next_id_ = 0;
};

StereoTracker::StereoTracker(const StereoInertialCalibration& calibration,
                             const StereoTrackerOptions& options)
    : impl_(std::make_unique<Impl>(calibration, options)) {}

StereoTracker::~StereoTracker() = default;

TrackedFrame StereoTracker::track(TimeNs t, const cv::Mat& left, const cv::Mat& right,
                                  const Eigen::Matrix3d& R_prev_cur) {
  return impl_->track(t, left, right, R_prev_cur);
}

const TrackingStatistics& StereoTracker::statistics() const { return impl_->statistics(); }

}  // namespace etalon
