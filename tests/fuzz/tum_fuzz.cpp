// Trajectories: TUM's format, and the CSV of EuRoC's ground truth.

#include "etalon/core/trajectory.h"
#include "etalon/datasets/euroc_files.h"
#include "fuzz_input.h"
#include "fuzz_targets.h"

void etalon::fuzz::tum(const std::uint8_t* data, std::size_t size) {
  const std::string path =
      inFile("poses.txt", std::string(reinterpret_cast<const char*>(data), size));
  mayRefuse([&] { readTum(path); });
  mayRefuse([&] { readGroundTruthCsv(path, 2); });
}
