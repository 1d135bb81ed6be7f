#include "etalon/map/map_options.h"

namespace etalon {

void MapOptions::declare(ParameterSet& parameters) {
  parameters.add("enabled", &enabled, "Whether old keyframes are kept and found again.");
  parameters.add(
      "relocalize", &relocalize,
      "Whether old keyframes are recognized after seconds without images or a loss: the pose jumps "
      "back to where they have it.");
  parameters.add("max_keyframes", &max_keyframes, {2, 100},
                 "Old keyframes that are kept, apart from those of [fixed_lag].");
  parameters.add("views", &views, {1, 100},
                 "Old keyframes in which a keyframe's landmarks are looked for, at most.");
  parameters.add("landmarks", &landmarks, {1, 5000},
                 "Landmarks that are looked for in an old keyframe, at most.");
  parameters.add("min_landmarks", &min_landmarks, {3, 5000},
                 "Least number of landmarks that must be found in an old keyframe and agree on its "
                 "pose.");
  parameters.add("spread_m", &spread_m, {0.01, 1000.0},
                 "The kept keyframes are chosen to differ as much as possible: two that are this "
                 "far apart, m, differ as much as two that are turned by spread_deg.");
  parameters.add("spread_deg", &spread_deg, {0.1, 360.0},
                 "Angle between two kept keyframes that counts as much as the distance spread_m, "
                 "deg.");
  parameters.add("sigma_factor", &sigma_factor, {0.1, 100.0},
                 "Ratio of the standard deviation of a pixel found in an old keyframe to that of a "
                 "tracked pixel, in the running odometry.");
  parameters.add("chi2_gate", &chi2_gate, {0.1, 1e9},
                 "A pixel found in an old keyframe is rejected if its squared distance, in its "
                 "standard deviations, from its prediction or from the position that the other "
                 "landmarks give is larger.");
}

}  // namespace etalon
