#include "gui/load_flight_window.h"

#include <dlfcn.h>

#include <cstdlib>
#include <string>

#include "etalon/core/errors.h"

namespace etalon::app {

MakeFlightWindow* loadFlightWindow() {
  if (std::getenv("DISPLAY") == nullptr)
    throw ConfigError(
        "--gui: there is no display: DISPLAY is not set; run it in a desktop session, or without "
        "--gui and open flight.3Dscene later");
  // A name without '/' is looked for where the program's own libraries are (its run path).
  void* const library = dlopen("libetalon_flight_window.so", RTLD_NOW | RTLD_LOCAL);
  void* const symbol = library ? dlsym(library, "etalon_make_flight_window") : nullptr;
  if (!symbol) {
    const char* const error = dlerror();
    throw ConfigError(
        "--gui: the window cannot be loaded: " + std::string(error ? error : "no reason given") +
        "; install libmrpt-gui-dev, then configure and build again");
  }
  return reinterpret_cast<MakeFlightWindow*>(symbol);
}

}  // namespace etalon::app
