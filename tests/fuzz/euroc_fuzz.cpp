// A small EuRoC folder of which one file is the input: the first byte says which.

#include "etalon/datasets/sensor_source.h"
#include "fuzz_recording.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace etalon;
  static fuzz::Recording recording;
  fuzz::Bytes bytes(data, size);
  const std::size_t file = bytes.take<std::uint8_t>() % fuzz::kFiles.size();
  recording.write(file, bytes.rest());
  fuzz::mayRefuse([&] {
    SourceOptions options;
    options.decode_images = false;
    const auto source = openSource(recording.path(), options);
    while (source->next()) {
    }
  });
  recording.restore(file);
  return 0;
}
