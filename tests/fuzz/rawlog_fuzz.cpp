// A .rawlog, read to its end. Observations that Etalon passes over are read by MRPT alone, which believes them.

#include <array>

#include "etalon/datasets/sensor_source.h"
#include "fuzz_input.h"
#include "fuzz_targets.h"

namespace {

bool namesOthers(const std::string& log) {
  constexpr std::array<const char*, 4> kKnown = {"Comment", "StereoImages", "IMU", "RobotPose"};
  const std::string prefix = "CObservation";
  for (size_t at = log.find(prefix); at != std::string::npos; at = log.find(prefix, at)) {
    at += prefix.size();
    bool known = false;
    for (const std::string name : kKnown) known = known || log.compare(at, name.size(), name) == 0;
    if (!known) return true;
  }
  return log.find("CAction") != std::string::npos;
}

}  // namespace

void etalon::fuzz::rawlog(const std::uint8_t* data, std::size_t size) {
  const std::string log(reinterpret_cast<const char*>(data), size);
  if (namesOthers(log)) return;
  const std::string path = inFile("log.rawlog", log);
  mayRefuse([&] {
    const auto source = openSource(path);
    while (source->next()) {
    }
  });
}
