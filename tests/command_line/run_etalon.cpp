#include "command_line.h"
#include "run_command.h"

namespace etalon::testing {

CommandResult runEtalon(const std::vector<std::string>& arguments) {
  return runForked([&] { return app::runCommandLine(arguments); });
}

}  // namespace etalon::testing
