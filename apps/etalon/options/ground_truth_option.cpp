#include "options/ground_truth_option.h"

#include <filesystem>
#include <fstream>
#include <utility>

#include "etalon/core/errors.h"
#include "etalon/datasets/euroc_files.h"

namespace etalon::app {
namespace {

/** Whether the first line with data has commas: EuRoC's CSV, else TUM. */
bool hasCommas(const std::string& path) {
  std::ifstream in(path);
  for (std::string line; std::getline(in, line);)
    if (!line.empty() && line[0] != '#') return line.find(',') != std::string::npos;
  return false;
}

/** A source whose ground truth is another one. */
class WithGroundTruth final : public SensorSource {
 public:
  WithGroundTruth(std::unique_ptr<SensorSource> source, GroundTruth truth)
      : source_(std::move(source)), truth_(std::move(truth)) {}

  const std::string& name() const override { return source_->name(); }
  std::string kind() const override { return source_->kind(); }
  const StereoInertialCalibration& calibration() const override { return source_->calibration(); }
  const GroundTruth& groundTruth() const override { return truth_; }
  const std::vector<TimeNs>& imageStamps() const override { return source_->imageStamps(); }
  std::optional<SensorEvent> next() override { return source_->next(); }
  const ReadStatistics& statistics() const override { return source_->statistics(); }

 private:
  std::unique_ptr<SensorSource> source_;
  GroundTruth truth_;
};

}  // namespace

GroundTruth readGroundTruth(const std::string& path) {
  const std::filesystem::path file(path);
  if (std::filesystem::is_directory(file) || file.extension() == ".rawlog" ||
      file.extension() == ".bag" || file.extension() == ".db3" || file.extension() == ".mcap") {
    SourceOptions options;
    options.decode_images = false;
    const auto source = openSource(path, options);
    if (source->groundTruth().empty()) throw DataError(path, 0, "has no ground truth");
    return source->groundTruth();
  }
  if (hasCommas(path)) return readGroundTruthCsv(path, 2);
  GroundTruth truth;
  for (const StampedPose& pose : readTum(path)) truth.states.emplace_back(pose.t, pose.T_WB);
  return truth;
}

void GroundTruthOption::add(CLI::App* command) {
  command->add_option("--ground-truth", file,
                      "Ground truth in place of the recording's own: EuRoC CSV or TUM file");
}

std::unique_ptr<SensorSource> GroundTruthOption::apply(std::unique_ptr<SensorSource> source) const {
  if (file.empty()) return source;
  return std::make_unique<WithGroundTruth>(std::move(source), readGroundTruth(file));
}

}  // namespace etalon::app
