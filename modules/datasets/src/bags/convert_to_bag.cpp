#include <filesystem>
#include <fstream>
#include <sstream>

#include "bags/bag_writer.h"
#include "calibration/kalibr_text.h"
#include "etalon/core/errors.h"
#include "etalon/core/output_file.h"

namespace etalon {

namespace {

namespace fs = std::filesystem;

[[noreturn]] void refuseNeighbour(const fs::path& file, const std::string& what) {
  throw ConfigError(file.string() + ": " + what +
                    " is there; expected a folder of its own for the bag");
}

void requireNoOther(const fs::path& file, const std::string& text) {
  std::ifstream in(file, std::ios::binary);
  if (!in) return;
  std::ostringstream there;
  there << in.rdbuf();
  if (there.str() != text) refuseNeighbour(file, "the calibration of another recording");
}

using CreateBag = std::unique_ptr<BagWriter> (*)(const std::string& path);

ConvertReport convertToBag(SensorSource& source, const fs::path& bag, const ConvertOptions& options,
                           CreateBag create) {
  const std::string camchain = camchainText(source.calibration(), kBagImageTopics);
  const std::string imu = kalibrImuText(source.calibration().imu, kBagImuTopic);
  requireNoOther(bag.parent_path() / "camchain.yaml", camchain);
  requireNoOther(bag.parent_path() / "imu.yaml", imu);
  OutputFiles files(bag.parent_path().string());
  writeFile(files.path("camchain.yaml"), camchain);
  writeFile(files.path("imu.yaml"), imu);
  ConvertReport report;
  try {
    const std::unique_ptr<BagWriter> writer = create(files.path(bag.filename().string()));
    report = writeEvents(source, options, writer.get());
    for (const StampedState& state : source.groundTruth().states) writer->write(state);
    writer->close();
  } catch (const Error&) {
    throw;
  } catch (const std::exception& e) {
    throw DataError(bag.string(), 0, std::string("the bag cannot be written: ") + e.what());
  }
  files.putInPlace();
  return report;
}

fs::path absolute(const std::string& path) { return fs::absolute(path).lexically_normal(); }

}  // namespace

ConvertReport convertToRosBag(SensorSource& source, const std::string& dst,
                              const ConvertOptions& options) {
  return convertToBag(source, absolute(dst), options, createRos1Bag);
}

ConvertReport convertToRos2Bag(SensorSource& source, const std::string& dst,
                               const ConvertOptions& options) {
  const fs::path bag = absolute(dst), metadata = bag.parent_path() / "metadata.yaml";
  if (fs::exists(metadata) && !fs::exists(bag)) refuseNeighbour(metadata, "another ROS 2 bag");
  return convertToBag(source, bag, options, createRos2Bag);
}

}  // namespace etalon
