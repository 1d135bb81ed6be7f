// A ROS bag, read to its end: ROS 1 or, where the first byte is odd, ROS 2 in sqlite3.

#include "etalon/datasets/sensor_source.h"
#include "fuzz_input.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace etalon;
  fuzz::Bytes bytes(data, size);
  const char* name = bytes.take<std::uint8_t>() % 2 == 1 ? "flight.db3" : "flight.bag";
  const std::string path = fuzz::inFile(name, bytes.rest());
  fuzz::mayRefuse([&] {
    const auto source = openSource(path);
    while (source->next()) {
    }
  });
  return 0;
}
