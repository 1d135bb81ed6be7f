#include "suite/open_recordings.h"

#include <filesystem>
#include <utility>

#include "etalon/benchmark/content_hash.h"
#include "etalon/benchmark/sequence_tracks.h"
#include "etalon/benchmark/windows.h"
#include "etalon/core/errors.h"
#include "etalon/datasets/ground_truth_file.h"
#include "etalon/frontend/recording_inspection.h"

namespace etalon {
namespace {

/** @throws DataError if it cannot be used; what is known by then is in `sequence` */
std::unique_ptr<RecordedSource> openSound(const std::string& source,
                                          const std::string& ground_truth,
                                          BenchmarkSequence* sequence) {
  SourceOptions options;
  options.ground_truth = groundTruthOf(sequence->name, ground_truth);
  std::unique_ptr<RecordedSource> recording = openRecording(source, options);
  sequence->source_kind = recording->kind();
  const std::vector<TimeNs>& stamps = recording->imageStamps();
  checkLength(source, stamps.front(), stamps.back());
  sequence->first_image = stamps.front();
  sequence->last_image = stamps.back();
  sequence->duration_s = secondsBetween(sequence->first_image, sequence->last_image);
  sequence->stereo_frames = stamps.size();
  sequence->has_ground_truth = !recording->groundTruth().empty();
  sequence->warnings = recording->statistics().warnings;
  if (!options.ground_truth.empty())
    sequence->warnings.push_back(sequence->name + ": ground truth of " + options.ground_truth +
                                 " in place of its own");
  for (std::string& warning : requireSoundRecording(source))
    sequence->warnings.push_back(std::move(warning));
  return recording;
}

}  // namespace

std::string contentOf(const RecordedSource& recording) {
  std::string files = recordingHash(recording);
  if (recording.options().ground_truth.empty()) return files;
  ContentHash hash;
  hash.add(files);
  for (const StampedState& state : recording.groundTruth().states) {
    hash.add(&state.t, sizeof state.t);
    for (const Eigen::MatrixXd& part :
         {Eigen::MatrixXd(state.T_WB.matrix()), Eigen::MatrixXd(state.v_WB),
          Eigen::MatrixXd(state.bias.gyro), Eigen::MatrixXd(state.bias.accel)})
      hash.add(part.data(), sizeof(double) * part.size());
  }
  return hash.hex();
}

std::vector<std::unique_ptr<RecordedSource>> openRecordings(
    const std::vector<std::string>& sources, const std::string& ground_truth,
    std::vector<BenchmarkSequence>* sequences) {
  requireDifferentNames(sources);
  std::vector<std::unique_ptr<RecordedSource>> recordings;
  for (const std::string& source : sources) {
    BenchmarkSequence sequence;
    sequence.name = recordingName(source);
    sequence.source = std::filesystem::absolute(source).lexically_normal().string();
    std::unique_ptr<RecordedSource> recording;
    try {
      recording = openSound(source, ground_truth, &sequence);
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
