#include "etalon/datasets/ground_truth_file.h"

#include <filesystem>
#include <fstream>

#include "etalon/core/errors.h"
#include "etalon/core/printable.h"
#include "etalon/datasets/euroc_files.h"
#include "etalon/datasets/recorded_source.h"

namespace etalon {
namespace {

namespace fs = std::filesystem;

/** Whether the first line with data has commas: EuRoC's CSV, else TUM. */
bool hasCommas(const std::string& path) {
  std::ifstream in(path);
  for (std::string line; std::getline(in, line);) {
    line = withoutByteOrderMark(line);
    const size_t first = line.find_first_not_of(" \t\r");
    if (first != std::string::npos && line[first] != '#')
      return line.find(',') != std::string::npos;
  }
  return false;
}

}  // namespace

GroundTruth readGroundTruth(const std::string& path) {
  if (isRecording(path)) {
    SourceOptions options;
    options.decode_images = false;
    const auto source = openSource(path, options);
    if (source->groundTruth().empty()) throw DataError(path, 0, "has no ground truth");
    return source->groundTruth();
  }
  if (fs::is_directory(path))
    throw DataError(path, 0, "expected a EuRoC CSV, a TUM file or a recording, found a folder");
  if (!fs::exists(path))
    throw DataError(path, 0,
                    "there is no such file; expected a ground truth: a EuRoC CSV, a TUM file or a "
                    "recording");
  GroundTruth truth;
  if (hasCommas(path))
    truth = readGroundTruthCsv(path, 2);
  else
    for (const StampedPose& pose : readTum(path)) truth.states.emplace_back(pose.t, pose.T_WB);
  if (truth.empty())
    throw DataError(path, 0, "has no pose; expected lines of a TUM file or of EuRoC's CSV");
  return truth;
}

bool isGroundTruthFolder(const std::string& path) {
  return fs::is_directory(path) && !isRecording(path);
}

std::string groundTruthOf(const std::string& recording, const std::string& path) {
  if (!isGroundTruthFolder(path)) return path;
  const fs::path folder(path);
  for (const fs::path& name : {fs::path(recording + ".csv"), fs::path(recording + ".tum"),
                               fs::path(recording) / "data.csv"})
    if (fs::is_regular_file(folder / name)) return (folder / name).string();
  if (isRecording(folder / recording)) return (folder / recording).string();
  throw DataError(path, 0,
                  "has no ground truth of '" + recording + "'; expected " + recording + ".csv, " +
                      recording + ".tum, " + recording + "/data.csv or the recording " + recording);
}

}  // namespace etalon
