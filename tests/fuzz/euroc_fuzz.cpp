// A small EuRoC folder of which one file is the input: the first byte says which.

#include "etalon/datasets/sensor_source.h"
#include "fuzz_recording.h"
#include "fuzz_targets.h"

void etalon::fuzz::euroc(const std::uint8_t* data, std::size_t size) {
  static Recording recording;
  Bytes bytes(data, size);
  const std::size_t file = bytes.take<std::uint8_t>() % kFiles.size();
  recording.write(file, bytes.rest());
  mayRefuse([&] {
    SourceOptions options;
    options.decode_images = false;
    const auto source = openSource(recording.path(), options);
    while (source->next()) {
    }
  });
  recording.restore(file);
}
