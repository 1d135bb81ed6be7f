#pragma once

#include <cstdint>
#include <memory>
#include <opencv2/core/mat.hpp>

#include "etalon/core/calibration.h"
#include "etalon/simulation/room.h"
#include "etalon/simulation/simulated_trajectory.h"

namespace etalon {

struct RenderOptions {
  /** Instants over the exposure that are averaged; 0 or 1 without motion blur. Rounded up to a
   * multiple of 4. */
  int blur_samples = 0;
  double exposure_ms = 8.0;   ///< around the stamp, which is its middle; used with blur only
  double noise_gray = 1.5;    ///< standard deviation of the sensor's noise in the dark, gray levels
  double shot_noise = 0.012;  ///< variance added a gray level of brightness, gray levels^2
  double vignetting = 0.0;    ///< darkening in the corners, 0 to 0.9 of the centre's brightness
  std::uint64_t seed = 1;     ///< of textures and noise
};

/**
 * Draws a room as the two raw (distorted) cameras of a rig see it, on the CPU: one ray for each of
 * four points of a pixel, through the calibration's distortion, into mipmapped procedural textures.
 * Pixels of a fisheye that lie beyond its lens are black.
 * Distances along rays and the projection of the camera model agree to well below a hundredth of a
 * pixel.
 *
 * Immutable once made; render() may run in several threads at once and its result depends on its
 * arguments only.
 */
class StereoRenderer {
 public:
  /** Throws ConfigError for options outside their ranges or a camera whose pixels cannot be
   * undistorted, unless it is a fisheye. */
  StereoRenderer(const Room& room, const StereoInertialCalibration& calibration,
                 const RenderOptions& options = {});
  ~StereoRenderer();
  StereoRenderer(StereoRenderer&&) noexcept;
  StereoRenderer& operator=(StereoRenderer&&) noexcept;

  /** What camera 0 (left) or 1 (right) sees at `t`: CV_8UC1 of the calibration's size. */
  cv::Mat render(size_t camera, const SimulatedTrajectory& trajectory, TimeNs t) const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace etalon
