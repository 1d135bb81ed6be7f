#include "etalon/map/map_options.h"

namespace etalon {

void MapOptions::declare(ParameterSet& parameters) {
  parameters.add("enabled", &enabled, "Whether old keyframes are kept and found again.");
  parameters.add("max_keyframes", &max_keyframes, {2, 100},
                 "Old keyframes that are kept, apart from those of [fixed_lag].");
  parameters.add("views", &views, {1, 100},
                 "Old keyframes in which a keyframe's landmarks are looked for, at most.");
  parameters.add("landmarks", &landmarks, {1, 5000},
                 "Landmarks that are looked for in an old keyframe, at most.");
  parameters.add("min_landmarks", &min_landmarks, {3, 5000},
                 "So many of them must be found, and agree on where the old keyframe is.");
  parameters.add("spread_m", &spread_m, {0.01, 1000.0},
                 "The keyframes that are kept are as different as can be: this far apart counts as "
                 "much, m, ...");
  parameters.add("spread_deg", &spread_deg, {0.1, 360.0},
                 "... as a view that is turned by this, deg.");
  parameters.add("sigma_factor", &sigma_factor, {0.1, 100.0},
                 "Standard deviation of a pixel that is found again over that of a track's, in the "
                 "running odometry.");
  parameters.add(
      "chi2_gate", &chi2_gate, {0.1, 1e9},
      "A pixel whose squared distance from its prediction, in its standard deviations, is "
      "larger was found wrongly; so was one that is as far from where the others have "
      "it.");
}

}  // namespace etalon
