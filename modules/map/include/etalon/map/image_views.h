#pragma once

#include <array>
#include <map>
#include <opencv2/core/mat.hpp>
#include <utility>

#include "etalon/frontend/anchor_patch.h"
#include "etalon/map/view_matcher.h"

namespace etalon {

/**
 * Old views as images. A landmark's patch is taken from the current left image and aligned (affine,
 * any gain) with the images of the view, from coarse to fine where the prediction is not good
 * enough to begin at the full resolution.
 */
class ImageViews : public ViewMatcher {
 public:
  /** The images of the current frame, CV_8UC1, whose pixels must stay as they are until the next
   * one is shown: they are copied only if the frame is kept. Empty ones: there are none. */
  void show(const cv::Mat& left, const cv::Mat& right);

  bool keep(TimeNs view) override;
  void dropAllBut(const std::vector<TimeNs>& views) override;
  std::vector<ViewMatch> find(TimeNs view, const std::vector<ViewQuery>& queries) override;

  /** Views that dropAllBut() leaves, in increasing order; instead of those pinned before. */
  void pin(const std::vector<TimeNs>& views) { pinned_ = views; }
  /** The images of a view, left and right; empty if it is not kept. */
  std::array<cv::Mat, 2> imagesOf(TimeNs view) const;
  /** The left image of the current frame. */
  const cv::Mat& left() const { return current_.left[0]; }

 private:
  static constexpr int kLevels = 3;  ///< each of half the resolution of the one before
  struct View {
    std::array<cv::Mat, kLevels> left;
    cv::Mat right;
  };
  ViewMatch find(const View& view, const ViewQuery& query);
  const AnchorPatch& patchOf(const ViewQuery& query, size_t level);

  View current_;
  std::map<std::pair<LandmarkId, size_t>, AnchorPatch> patches_;  ///< of current_, by level
  std::map<TimeNs, View> views_;
  std::vector<TimeNs> pinned_;
};

}  // namespace etalon
