// A ROS bag, read to its end: ROS 1 or, where the first byte is odd, ROS 2 in sqlite3.

#include "etalon/datasets/sensor_source.h"
#include "fuzz_input.h"
#include "fuzz_targets.h"

void etalon::fuzz::bag(const std::uint8_t* data, std::size_t size) {
  Bytes bytes(data, size);
  const char* name = bytes.take<std::uint8_t>() % 2 == 1 ? "flight.db3" : "flight.bag";
  const std::string path = inFile(name, bytes.rest());
  mayRefuse([&] {
    const auto source = openSource(path);
    while (source->next()) {
    }
  });
}
