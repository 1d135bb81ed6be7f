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
  /** @throws ConfigError if the build has no window (MRPT's gui library was missing), or if there is
   * no display */
  static void requireDisplay();

  /** Opens the window and listens to `pipeline`, which outlives it. */
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
