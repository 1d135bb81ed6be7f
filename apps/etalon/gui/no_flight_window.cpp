// Replaces flight_window.cpp where MRPT's gui library was missing at build time.
#include "etalon/core/errors.h"
#include "gui/flight_window.h"

namespace etalon::app {

struct FlightWindow::Impl {};

void FlightWindow::requireDisplay() {
  throw ConfigError(
      "--gui: this build has no window: install libmrpt-gui-dev, then configure and build again");
}

FlightWindow::FlightWindow(Pipeline* /*pipeline*/) {}
FlightWindow::~FlightWindow() = default;
void FlightWindow::update() {}
void FlightWindow::waitUntilClosed() {}

}  // namespace etalon::app
