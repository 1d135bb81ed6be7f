#pragma once

#include <atomic>

#include "etalon/pipeline/pipeline.h"

namespace etalon::app {

/**
 * A window that shows the flight in 3-D (trajectory, keyframes, landmarks) and the left image with
 * its tracks while the pipeline runs. Closing it does not stop the run. Made by
 * loadFlightWindow(), from a library of its own.
 */
class FlightWindow {
 public:
  virtual ~FlightWindow() = default;

  /** Draws the pipeline's present state, at most ten times a second. */
  virtual void update() = 0;
  /** Draws the end of the flight and waits until the window is closed or `stop` is set. */
  virtual void waitUntilClosed(const std::atomic<bool>& stop) = 0;
};

}  // namespace etalon::app

/** Opens the window and listens to `pipeline`, which must outlive it. The caller deletes it. */
extern "C" etalon::app::FlightWindow* etalon_make_flight_window(etalon::Pipeline* pipeline);
