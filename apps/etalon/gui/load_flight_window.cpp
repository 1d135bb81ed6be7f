#include "gui/load_flight_window.h"

#include <dlfcn.h>

#include <cstdlib>
#include <string>

#include "etalon/core/errors.h"

namespace etalon::app {

namespace {

/** Whether an X server answers at DISPLAY; also true where that cannot be told. The libraries of the
 * window would go on without one and draw nothing. */
bool displayAnswers() {
  void* const x11 = dlopen("libX11.so.6", RTLD_NOW | RTLD_LOCAL);
  if (!x11) return true;
  const auto open = reinterpret_cast<void* (*)(const char*)>(dlsym(x11, "XOpenDisplay"));
  const auto close = reinterpret_cast<int (*)(void*)>(dlsym(x11, "XCloseDisplay"));
  void* const display = open ? open(nullptr) : nullptr;
  if (display && close) close(display);
  return !open || display;
}

}  // namespace

MakeFlightWindow* loadFlightWindow() {
  const char* const name = std::getenv("DISPLAY");
  if (!name || !displayAnswers())
    throw ConfigError(
        "--gui: there is no display: " +
        (name ? "no X server answers at DISPLAY=" + std::string(name)
              : std::string("DISPLAY is not set")) +
        "; run it in a desktop session, or without --gui and open flight.3Dscene later");
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
