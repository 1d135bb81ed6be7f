// A .rawlog, read to its end.

#include "etalon/datasets/sensor_source.h"
#include "fuzz_input.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace etalon;
  const std::string path =
      fuzz::inFile("log.rawlog", std::string(reinterpret_cast<const char*>(data), size));
  fuzz::mayRefuse([&] {
    const auto source = openSource(path);
    while (source->next()) {
    }
  });
  return 0;
}
