#pragma once

#include <array>
#include <map>
#include <memory>
#include <opencv2/core/mat.hpp>
#include <optional>
#include <utility>
#include <vector>

#include "etalon/core/calibration.h"
#include "etalon/frontend/anchor_patch.h"
#include "etalon/map/view_matcher.h"

namespace etalon {

struct ImageFeatures;
struct ViewFeatures;

/**
 * Old views as images. A landmark's patch is taken from the current left image and aligned (affine,
 * any gain) with the images of the view, from coarse to fine where the prediction is not good
 * enough to begin at the full resolution. Without a prediction a view is recognised by its ORB
 * features.
 */
class ImageViews : public ViewMatcher {
 public:
  explicit ImageViews(const StereoInertialCalibration& calibration) : calibration_(calibration) {}

  /** The images of the current frame, CV_8UC1, whose pixels must stay as they are until the next
   * one is shown: they are copied only if the frame is kept. Empty ones: there are none. */
  void show(const cv::Mat& left, const cv::Mat& right);

  bool keep(TimeNs view) override;
  void dropAllBut(const std::vector<TimeNs>& views) override;
  std::vector<ViewMatch> find(TimeNs view, const std::vector<ViewQuery>& queries) override;
  /** Some 20 ms for a view. */
  bool prepare(TimeNs view) override;
  /** Some 10 ms for the current image and 2 for a view. */
  std::optional<OldView> recognize(TimeNs view) override;

  /** Views that dropAllBut() leaves, in increasing order; instead of those pinned before. */
  void pin(const std::vector<TimeNs>& views) { pinned_ = views; }
  bool has(TimeNs view) const { return views_.count(view) > 0; }

 private:
  static constexpr int kLevels = 3;  ///< each of half the resolution of the one before
  struct View {
    std::array<cv::Mat, kLevels> left;
    cv::Mat right;
    std::shared_ptr<const ViewFeatures> features;  ///< once it is prepared
  };
  ViewMatch find(const View& view, const ViewQuery& query);
  const AnchorPatch& patchOf(const ViewQuery& query, size_t level);

  StereoInertialCalibration calibration_;
  View current_;
  std::shared_ptr<const ImageFeatures> current_features_;         ///< once they are asked for
  std::map<std::pair<LandmarkId, size_t>, AnchorPatch> patches_;  ///< of current_, by level
  std::map<TimeNs, View> views_;
  std::vector<TimeNs> pinned_;
};

}  // namespace etalon
