#pragma once

#include <vector>

#include "etalon/map/view_geometry.h"

namespace etalon {

/** What an old view shows of the current frame's landmarks. */
struct ViewFindings {
  static constexpr size_t kMinLandmarks = 20;
  static constexpr double kMinShare = 0.3;

  double reach_px = 0.0;                  ///< ViewQuery::reach_px, median
  std::vector<size_t> asked;              ///< indices of landmarks that it should show
  std::vector<FoundLandmark> landmarks;   ///< that agree with the prediction and with each other
  std::vector<Observation> observations;  ///< their pixels there

  /** Enough, and enough of what was asked, to believe a guess by how the view looks. Scenes repeat
   * themselves: where a guess is wrong, a tenth of the landmarks seem to agree. */
  bool confirmGuess() const;
};

/** Looks for landmarks in old views. */
struct ViewSearch {
  const StereoInertialCalibration& calibration;
  const MapOptions& options;
  double sigma_px;        ///< of a pixel that is found in a view
  double pixel_variance;  ///< of such a pixel, in sigma_px
  ViewMatcher& matcher;

  /** @param which indices of the landmarks that are looked for */
  ViewFindings find(TimeNs name, const OldView& view, const std::vector<SeenLandmark>& landmarks,
                    const std::vector<size_t>& which) const;
};

}  // namespace etalon
