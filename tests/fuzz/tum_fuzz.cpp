// Trajectories: TUM's format, and the CSV of EuRoC's ground truth.

#include "etalon/core/trajectory.h"
#include "etalon/datasets/euroc_files.h"
#include "fuzz_input.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace etalon;
  const std::string path =
      fuzz::inFile("poses.txt", std::string(reinterpret_cast<const char*>(data), size));
  fuzz::mayRefuse([&] { readTum(path); });
  fuzz::mayRefuse([&] { readGroundTruthCsv(path, 2); });
  return 0;
}
