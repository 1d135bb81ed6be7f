#pragma once

#include "etalon/core/parameters.h"

namespace etalon {

/** Section [map]. */
struct MapOptions {
  bool enabled = true;
  bool relocalize = true;     ///< old keyframes are recognised after seconds without images
  int max_keyframes = 12;     ///< old keyframes that are kept, and so many across a loss
  int views = 3;              ///< of these, so many are searched at a keyframe, at most
  int landmarks = 60;         ///< that are looked for in a view, at most
  int min_landmarks = 10;     ///< that must be found in a view, and agree
  double spread_m = 1.5;      ///< two views so far apart are as different as two ...
  double spread_deg = 30.0;   ///< ... of which one is turned by so much
  double sigma_factor = 4.0;  ///< standard deviation of a pixel that was found again, in a track's
  double chi2_gate = 16.0;    ///< of such a pixel against its prediction, and against the others

  void declare(ParameterSet& parameters);
};

}  // namespace etalon
