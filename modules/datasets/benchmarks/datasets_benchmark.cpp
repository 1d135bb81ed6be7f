// Reading and converting a recording of EuRoC: frames a second.

#include <benchmark/benchmark.h>

#include <filesystem>

#include "etalon/datasets/convert.h"
#include "etalon/datasets/sensor_source.h"

namespace {

using namespace etalon;

const std::string kRecording = ETALON_BENCHMARK_RECORDING;

std::string temporaryLog() {
  return (std::filesystem::temp_directory_path() / "etalon_datasets_benchmark.rawlog").string();
}

ConvertReport convert(bool embed) {
  SourceOptions source_options;
  source_options.decode_images = embed;
  ConvertOptions options;
  options.embed = embed;
  return convertToRawlog(*openSource(kRecording, source_options), temporaryLog(), options);
}

int read(const std::string& path, bool decode) {
  SourceOptions options;
  options.decode_images = decode;
  const auto source = openSource(path, options);
  while (const auto event = source->next()) benchmark::DoNotOptimize(stampOf(*event));
  return source->statistics().stereo_frames;
}

/** Runs `work`, which returns a number of stereo frames. */
template <typename Work>
void measure(benchmark::State& state, Work work) {
  double frames = 0;
  for (auto _ : state) frames += work();
  state.counters["frames/s"] = benchmark::Counter(frames, benchmark::Counter::kIsRate);
  std::filesystem::remove(temporaryLog());
}

void BM_ReadFolder(benchmark::State& state) {
  measure(state, [] { return read(kRecording, true); });
}
void BM_ReadFolderWithoutPixels(benchmark::State& state) {
  measure(state, [] { return read(kRecording, false); });
}
void BM_ConvertExternal(benchmark::State& state) {
  measure(state, [] { return convert(false).stereo_frames; });
}
void BM_ConvertEmbedded(benchmark::State& state) {
  measure(state, [] { return convert(true).stereo_frames; });
}
void BM_ReadRawlogExternal(benchmark::State& state) {
  convert(false);
  measure(state, [] { return read(temporaryLog(), true); });
}
void BM_ReadRawlogEmbedded(benchmark::State& state) {
  convert(true);
  measure(state, [] { return read(temporaryLog(), true); });
}

BENCHMARK(BM_ReadFolder)->Unit(benchmark::kMillisecond)->UseRealTime();
BENCHMARK(BM_ReadFolderWithoutPixels)->Unit(benchmark::kMillisecond)->UseRealTime();
BENCHMARK(BM_ConvertExternal)->Unit(benchmark::kMillisecond)->UseRealTime();
BENCHMARK(BM_ConvertEmbedded)->Unit(benchmark::kMillisecond)->UseRealTime();
BENCHMARK(BM_ReadRawlogExternal)->Unit(benchmark::kMillisecond)->UseRealTime();
BENCHMARK(BM_ReadRawlogEmbedded)->Unit(benchmark::kMillisecond)->UseRealTime();

}  // namespace
