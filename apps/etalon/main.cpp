#include <exception>
#include <iostream>

#include "commands.h"
#include "etalon/core/errors.h"

int main(int argc, char** argv) {
  using namespace etalon::app;
  CLI::App app{
      "Etalon: stereo-inertial odometry whose initializer is a plugin chosen in an INI file."};
  app.name("etalon");
  app.set_version_flag("--version", ETALON_VERSION);
  app.require_subcommand(1);
  int exit_code = kOk;
  addSimulateCommand(app, &exit_code);
  try {
    app.parse(argc, argv);
    return exit_code;
  } catch (const CLI::ParseError& e) {
    return app.exit(e) == 0 ? kOk : kUsageError;
  } catch (const etalon::DataError& e) {
    std::cerr << "etalon: " << e.what() << "\n";
    return kDataErrorExit;
  } catch (const etalon::Error& e) {
    std::cerr << "etalon: " << e.what() << "\n";
    return kUsageError;
  } catch (const std::exception& e) {
    std::cerr << "etalon: unexpected error: " << e.what() << "\n";
    return kDataErrorExit;
  }
}
