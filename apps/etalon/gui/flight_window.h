#pragma once

#include <memory>

#include "etalon/pipeline/pipeline.h"

namespace etalon::app {

/**
 * A window that shows the flight in 3-D (trajectory, keyframes, landmarks) and the left image with
 * its tracks while the pipeline runs. Closing it does not stop the run.
 */
class FlightWindow {
 public:
  /** @throws ConfigError if this build has no flight window (MRPT's gui library was missing), or if
   * there is no display */
  static void requireDisplay();

  /** Opens the window and listens to `pipeline`, which must outlive it. */
  explicit FlightWindow(Pipeline* pipeline);
  ~FlightWindow();

  /** Draws the pipeline's present state, at most ten times a second. */
  void update();
  /** Draws the end of the flight and waits until the window is closed. */
  void waitUntilClosed();

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace etalon::app
