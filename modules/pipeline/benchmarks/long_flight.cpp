// long_flight SRC [--hours H] [--history FRAMES]; --help lists them.
//
// Flies a recording again and again, its stamps going on, and prints once in five minutes of flight
// how much memory the process has in use: it must not grow. At each seam the platform is elsewhere
// all of a sudden, so that the odometry is lost and starts again.

#include <unistd.h>

#include <cstdio>
#include <fstream>
#include <limits>
#include <string>

#include "etalon/core/errors.h"
#include "etalon/datasets/recorded_source.h"
#include "etalon/pipeline/run_configuration.h"
#include "etalon/testing/program.h"

namespace etalon {
namespace {

/** Resident memory of this process, MB. */
double residentMegabytes() {
  std::ifstream statm("/proc/self/statm");
  double pages = 0.0, resident = 0.0;
  statm >> pages >> resident;
  return resident * static_cast<double>(sysconf(_SC_PAGESIZE)) / 1e6;
}

void fly(const std::string& source, double hours, size_t history, const IniFile& ini) {
  RunConfiguration configuration = loadRunConfiguration(ini, {});
  configuration.pipeline.history_frames = history;
  Pipeline pipeline(openRecording(source)->calibration(), configuration.pipeline,
                    configuration.initializers);
  int frames = 0;
  pipeline.onFrame([&frames](const FrameEstimate&) { ++frames; });
  std::printf("minutes   frames   MB in use   starts   state\n");
  TimeNs shift = 0, last = 0, first = std::numeric_limits<TimeNs>::min();
  double printed_s = 0.0;
  const double end_s = 3600.0 * hours;
  for (double flown_s = 0.0; flown_s < end_s;) {
    const auto recording = openRecording(source);
    const TimeNs before = last;
    bool at_seam = before != 0;
    while (const auto event = recording->next()) {
      if (at_seam) shift = before + durationNs(0.05) - stampOf(*event);
      at_seam = false;
      std::visit(
          [&](auto measurement) {
            measurement.t += shift;
            last = std::max(last, measurement.t);
            pipeline.add(measurement);
          },
          *event);
      if (first == std::numeric_limits<TimeNs>::min()) first = last;
      flown_s = secondsBetween(first, last);
      if (flown_s - printed_s < 300.0 && flown_s < end_s) continue;
      printed_s = flown_s;
      int starts = 0;
      for (const PipelineEvent& e : pipeline.events())
        starts += !e.remark && e.state == PipelineState::kInertial;
      std::printf("%7.1f  %7d   %9.1f   %6d   %s\n", flown_s / 60.0, frames, residentMegabytes(),
                  starts, toString(pipeline.state()));
      std::fflush(stdout);
      if (flown_s >= end_s) break;
    }
  }
  pipeline.finish();
}

}  // namespace
}  // namespace etalon

int main(int argc, char** argv) {
  CLI::App app("Flies a recording again and again and prints the memory in use.");
  std::string source;
  double hours = 1.0;
  size_t history = 1200;
  etalon::testing::IniOptions ini;
  app.add_option("SRC", source, "Recording")->required();
  app.add_option("--hours", hours, "Length of the flight")->check(CLI::PositiveNumber);
  app.add_option("--history", history, "Frames that are remembered; 0: all");
  ini.addTo(&app);
  return etalon::testing::runProgram(&app, argc, argv,
                                     [&] { etalon::fly(source, hours, history, ini.ini()); });
}
