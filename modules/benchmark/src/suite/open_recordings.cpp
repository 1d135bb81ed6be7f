#include "suite/open_recordings.h"

#include <filesystem>
#include <set>
#include <utility>

#include "etalon/benchmark/content_hash.h"
#include "etalon/benchmark/sequence_tracks.h"
#include "etalon/benchmark/windows.h"
#include "etalon/core/errors.h"
#include "etalon/frontend/recording_inspection.h"

namespace etalon {
namespace {

/** @throws DataError if it cannot be used; what is known by then is in `sequence` */
std::unique_ptr<RecordedSource> openSound(const std::string& source, BenchmarkSequence* sequence) {
  std::unique_ptr<RecordedSource> recording = openRecording(source);
  sequence->source_kind = recording->kind();
  const std::vector<TimeNs>& stamps = recording->imageStamps();
  checkLength(source, stamps.front(), stamps.back());
  sequence->first_image = stamps.front();
  sequence->last_image = stamps.back();
  sequence->duration_s = secondsBetween(sequence->first_image, sequence->last_image);
  sequence->stereo_frames = stamps.size();
  sequence->has_ground_truth = !recording->groundTruth().empty();
  sequence->warnings = recording->statistics().warnings;
  for (std::string& warning : requireSoundRecording(source))
    sequence->warnings.push_back(std::move(warning));
  return recording;
}

}  // namespace

std::vector<std::unique_ptr<RecordedSource>> openRecordings(
    const std::vector<std::string>& sources, std::vector<BenchmarkSequence>* sequences) {
  std::set<std::string> names;
  std::vector<std::unique_ptr<RecordedSource>> recordings;
  for (const std::string& source : sources) {
    BenchmarkSequence sequence;
    sequence.name = recordingName(source);
    if (!names.insert(sequence.name).second)
      throw ConfigError("two recordings are called '" + sequence.name +
                        "'; their folders or files need different names (" + source + ")");
    sequence.source = std::filesystem::absolute(source).lexically_normal().string();
    std::unique_ptr<RecordedSource> recording;
    try {
      recording = openSound(source, &sequence);
    } catch (const DataError& e) {
      sequence.error = e.what();
    }
    sequences->push_back(std::move(sequence));
    recordings.push_back(std::move(recording));
  }
  return recordings;
}

std::vector<BenchmarkInitializer> initializerRecords(
    const std::vector<ConfiguredInitializer>& initializers) {
  std::vector<BenchmarkInitializer> records;
  for (const ConfiguredInitializer& initializer : initializers)
    records.push_back({initializer.plugin.name, initializer.plugin.version,
                       initializer.plugin.description, fileHash(initializer.plugin.path),
                       initializer.ini});
  return records;
}

}  // namespace etalon
