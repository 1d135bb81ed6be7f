#pragma once

#include <map>
#include <string>

namespace etalon::app {

/** Versions of the program and of the libraries whose code decides its results. */
std::map<std::string, std::string> versions();

}  // namespace etalon::app
