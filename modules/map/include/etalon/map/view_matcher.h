#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "etalon/core/se3.h"
#include "etalon/core/time.h"
#include "etalon/core/tracked_frame.h"

namespace etalon {

/** A landmark of the current frame that is looked for in an old view. Pixels are raw ones. */
struct ViewQuery {
  LandmarkId id = 0;
  Eigen::Vector2d pixel = Eigen::Vector2d::Zero();  ///< in the left image of the current frame
  /** Where the poses have it in the view, left and right, px. */
  Eigen::Vector2d left = Eigen::Vector2d::Zero(), right = Eigen::Vector2d::Zero();
  bool has_right = false;  ///< whether the right image shows it
  double reach_px = 0.0;   ///< how far from there it may be in the left image
  Eigen::Matrix2d A = Eigen::Matrix2d::Identity();  ///< offsets in the current image to the view's
};

/** Where it was found. */
struct ViewMatch {
  bool found = false, has_right = false;
  Eigen::Vector2d left = Eigen::Vector2d::Zero(), right = Eigen::Vector2d::Zero();  ///< px
};

/** An old view V against the current frame N. */
struct OldView {
  SE3 T_NV;  ///< body to body
  /** Of T_NV, [rotation by right perturbation, position in N]. */
  Eigen::Matrix<double, 6, 6> covariance = Eigen::Matrix<double, 6, 6>::Zero();
};

/** Finds landmarks of the current frame in frames of the past. */
class ViewMatcher {
 public:
  virtual ~ViewMatcher() = default;

  /** Keeps the current frame as the view of that name; false if it has no images, or if the left one
   * shows nothing. */
  virtual bool keep(TimeNs view) = 0;
  /** Forgets all views but these, which are in increasing order. */
  virtual void dropAllBut(const std::vector<TimeNs>& views) = 0;
  /** One match a query. */
  virtual std::vector<ViewMatch> find(TimeNs view, const std::vector<ViewQuery>& queries) = 0;

  /** Makes a view ready for recognize(). @return false if it was, or if there is no such view */
  virtual bool prepare(TimeNs /*view*/) { return false; }
  /** A first guess of where a view is that the current frame shows, too, without a prediction;
   * nothing if it is not recognised. It may be wrong: scenes repeat themselves. */
  virtual std::optional<OldView> recognize(TimeNs /*view*/) { return std::nullopt; }

 protected:
  ViewMatcher() = default;
  ViewMatcher(const ViewMatcher&) = default;
  ViewMatcher& operator=(const ViewMatcher&) = default;
};

}  // namespace etalon
