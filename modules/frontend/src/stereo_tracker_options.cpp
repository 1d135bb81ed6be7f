#include "etalon/frontend/stereo_tracker.h"

namespace etalon {

void StereoTrackerOptions::declare(ParameterSet& parameters) {
  parameters.add("max_features", &max_features, {10, 5000}, "Landmarks followed at a time.");
  parameters.add("flight_features", &flight_features, {10, 5000},
                 "The same once the odometry flies: more do not make it more accurate; at most "
                 "max_features.");
  parameters.add("klt_window_px", &klt_window_px, {5, 63}, "Side of the KLT patch, px (odd).");
  parameters.add("klt_levels", &klt_levels, {1, 8}, "Pyramid levels above the full image.");
  parameters.add("klt_iterations", &klt_iterations, {1, 1000},
                 "KLT iterations per level, at most.");
  parameters.add("klt_epsilon_px", &klt_epsilon_px, {1e-6, 1.0},
                 "A KLT iteration that moves less ends the level, px.");
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
  parameters.add(
      "anchor_window_px", &anchor_window_px, {7, 63},
      "Side of the patch that a track keeps from its first frame, or from where its scale "
      "has changed, and is aligned with in later left and right images, px (odd).");
  parameters.add("anchor_iterations", &anchor_iterations, {1, 1000},
                 "Iterations of that alignment, at most: one that takes more fails.");
  parameters.add("anchor_epsilon_px", &anchor_epsilon_px, {1e-6, 1.0},
                 "An iteration that moves less, or after which the next one would, is the last, "
                 "px.");
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

}  // namespace etalon
