#pragma once

#include <CLI/CLI.hpp>
#include <cstdio>
#include <exception>
#include <functional>
#include <string>
#include <vector>

#include "etalon/core/ini_file.h"

namespace etalon::testing {

/** `-c FILE` and `--set section.key=value`: the configuration of a benchmark program. */
class IniOptions {
 public:
  void addTo(CLI::App* app) {
    app->add_option("-c,--config", file_, "Configuration (INI)");
    app->add_option("--set", values_, "A value: section.key=value")->allow_extra_args(false);
  }
  IniFile ini() const {
    IniFile ini = file_.empty() ? IniFile() : IniFile::fromFile(file_);
    for (const std::string& value : values_) ini.setFromArgument(value);
    return ini;
  }

 private:
  std::string file_;
  std::vector<std::string> values_;
};

/** Parses the arguments and runs `body`. The exit code: 2 for wrong usage, 3 for what it throws. */
inline int runProgram(CLI::App* app, int argc, char** argv, const std::function<void()>& body) {
  try {
    app->parse(argc, argv);
  } catch (const CLI::ParseError& e) {
    return app->exit(e) == 0 ? 0 : 2;
  }
  try {
    body();
  } catch (const std::exception& e) {
    std::fprintf(stderr, "%s: %s\n", app->get_name().c_str(), e.what());
    return 3;
  }
  return 0;
}

}  // namespace etalon::testing
