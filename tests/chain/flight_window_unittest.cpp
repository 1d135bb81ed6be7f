#include <gtest/gtest.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <future>
#include <map>
#include <stdexcept>
#include <string>
#include <thread>

#include "chain_files.h"

namespace etalon::testing {
namespace {

/** Waits until `condition` holds; false if it does not within a minute. */
bool waitFor(const std::function<bool()>& condition) {
  const auto end = std::chrono::steady_clock::now() + std::chrono::minutes(1);
  while (!condition()) {
    if (std::chrono::steady_clock::now() > end) return false;
    std::this_thread::sleep_for(std::chrono::milliseconds(50));
  }
  return true;
}

/** A virtual X server of one screen. It has no window manager, so that a window opens in the upper
 * left corner. */
class VirtualScreen {
 public:
  VirtualScreen() {
    int ends[2];
    if (pipe(ends) != 0) throw std::runtime_error("no pipe");
    const std::string end = std::to_string(ends[1]);
    server_ = fork();
    if (server_ == 0) {
      execl(ETALON_XVFB, "Xvfb", "-displayfd", end.c_str(), "-screen", "0", "1200x800x24",
            "-nolisten", "tcp", "-fbdir", folder_.path().c_str(), nullptr);
      _exit(1);
    }
    close(ends[1]);
    // It chooses a free display, and writes its number when it takes connections.
    for (char c = 0; read(ends[0], &c, 1) == 1 && c != '\n';) display_ += c;
    close(ends[0]);
    if (display_.empty()) throw std::runtime_error("Xvfb does not start");
  }
  ~VirtualScreen() {
    kill(server_, SIGTERM);
    waitpid(server_, nullptr, 0);
  }
  VirtualScreen(const VirtualScreen&) = delete;
  VirtualScreen& operator=(const VirtualScreen&) = delete;

  std::string display() const { return ":" + display_; }

  /** How many pixels have each colour, 0xRRGGBB, now. */
  std::map<std::uint32_t, int> colours() const {
    // The server's screen as a file of xwd: a header of numbers of four bytes, of the largest
    // first; then the table of colours, 12 bytes each; then the pixels, blue first.
    const std::string file = readText((folder_ / "Xvfb_screen0").string());
    const auto byte = [&file](size_t at) {
      return static_cast<std::uint32_t>(static_cast<unsigned char>(file.at(at)));
    };
    const auto header = [&byte](size_t field) {
      std::uint32_t value = 0;
      for (size_t i = 0; i < 4; ++i) value = value << 8 | byte(4 * field + i);
      return value;
    };
    const size_t begin = header(0) + 12 * header(19);
    const size_t width = header(4), height = header(5), bytes_a_line = header(12);
    std::map<std::uint32_t, int> counts;
    for (size_t y = 0; y < height; ++y)
      for (size_t x = 0; x < width; ++x) {
        const size_t at = begin + y * bytes_a_line + 4 * x;
        ++counts[byte(at + 2) << 16 | byte(at + 1) << 8 | byte(at)];
      }
    return counts;
  }

 private:
  TemporaryFolder folder_;
  pid_t server_ = 0;
  std::string display_;
};

/** Whether the left image with its shades of grey and the landmarks (see sceneOf()) are seen. */
bool showsTheFlight(const std::map<std::uint32_t, int>& colours) {
  const auto landmarks = colours.find(0xC83C1E);
  return colours.size() > 100 && landmarks != colours.end() && landmarks->second > 20;
}

TEST(FlightWindow, ShowsTheFlightUntilCtrlCAndChangesNothing) {
  if (std::string(ETALON_XVFB).empty())
    GTEST_SKIP() << "Xvfb (package xvfb) is not installed, or the window is not built";
  const TemporaryFolder folder;
  const std::string unseen = folder.path() + "/unseen", seen = folder.path() + "/seen";
  ASSERT_EQ(runEtalon({"replay", kFlight, "--from", kInMotion, "--out", unseen}).exit_code, 0);

  const VirtualScreen screen;
  const std::string said = folder.write("said", ""), end = folder.path() + "/end";
  std::future<CommandResult> replay = std::async(std::launch::async, [&] {
    return runProgram(
        "/bin/sh", {"-c", "DISPLAY=" + screen.display() + " '" ETALON_EXECUTABLE "' replay --gui " +
                              kFlight + " --from " + kInMotion + " --out " + seen + " > " + said +
                              " & pid=$!; until test -e " + end +
                              "; do sleep 0.05; done; kill -TERM $pid; wait $pid"});
  });
  const bool waits = waitFor([&] { return readText(said).find("to end\n") != std::string::npos; });
  const bool shown = waitFor([&] { return !waits || showsTheFlight(screen.colours()); });
  folder.write("end", "");
  const CommandResult result = replay.get();
  EXPECT_TRUE(waits) << readText(said);
  EXPECT_TRUE(shown);
  EXPECT_EQ(result.exit_code, 0) << result.err;
  EXPECT_EQ(readText(seen + "/trajectory.tum"), readText(unseen + "/trajectory.tum"));
}

}  // namespace
}  // namespace etalon::testing
