#pragma once

#include "gui/flight_window.h"

namespace etalon::app {

/** etalon_make_flight_window(), once its library is loaded. */
using MakeFlightWindow = decltype(etalon_make_flight_window);

/**
 * Loads the library of the window. It is not linked, because MRPT's gui library brings in some
 * seventy others, which would nearly double the time that every command takes to start.
 *
 * @throws ConfigError if there is no display, or if the library is missing or cannot be loaded
 */
MakeFlightWindow* loadFlightWindow();

}  // namespace etalon::app
