#pragma once

#include <memory>

#include "etalon/pipeline/pipeline.h"

namespace etalon::app {

/**
 * A window with the flight in 3-D (trajectory, keyframes, landmarks) and the left image with its
 * tracks, while the pipeline runs. Closing it leaves the run alone.
 */
class FlightWindow {
 public:
  /** Whether this build has a window at all (MRPT's gui library was there). */
  static bool available();

  /** Opens the window and listens to `pipeline`, which outlives it.
   * @throws ConfigError if the build has no window or there is no display */
  explicit FlightWindow(Pipeline* pipeline);
  ~FlightWindow();

  /** Draws what the pipeline has now, at most ten times a second. */
  void update();
  /** Draws the end of the flight and waits until the window is closed. */
  void waitUntilClosed();

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace etalon::app
