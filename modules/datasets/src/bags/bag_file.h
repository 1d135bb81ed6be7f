#pragma once

#include <cstdint>
#include <memory>
#include <opencv2/core/mat.hpp>
#include <string>
#include <vector>

#include "etalon/core/trajectory.h"
#include "etalon/imu/imu_sample.h"

namespace etalon {

// The types of messages that are read, as ROS 1 names them.
constexpr const char* kImageType = "sensor_msgs/Image";
constexpr const char* kCompressedImageType = "sensor_msgs/CompressedImage";
constexpr const char* kImuType = "sensor_msgs/Imu";
constexpr const char* kPoseType = "geometry_msgs/PoseStamped";

struct BagTopic {
  std::string name;
  std::string type;  ///< of its messages: "sensor_msgs/Image"
  size_t messages = 0;
};

/** Where an image lies in a bag, and its header's stamp. */
struct BagImageEntry {
  TimeNs t = 0;
  size_t handle = 0;
};

/** What sensor_msgs/Image and sensor_msgs/CompressedImage hold. */
struct BagImage {
  bool compressed = false;
  std::string encoding;  ///< of pixels, or the format if compressed
  std::uint32_t width = 0, height = 0, step = 0;
  bool big_endian = false;
  std::vector<std::uint8_t> data;
};

/**
 * An image in 8 bits of gray. Of 16 bits the upper eight are kept.
 * @param problem receives why there is none; the result is empty then
 */
cv::Mat toGray(const BagImage& image, std::string* problem);

/** What one kind of bag does by itself; all members throw DataError. */
class BagFile {
 public:
  BagFile() = default;
  virtual ~BagFile() = default;
  BagFile(const BagFile&) = delete;
  BagFile& operator=(const BagFile&) = delete;

  /** In the order of their names. */
  virtual std::vector<BagTopic> topics() const = 0;
  /** The files that the bag is made of. */
  virtual std::vector<std::string> files() const = 0;

  // All messages of a topic, in the order of the bag, with the stamps of their headers.
  virtual std::vector<BagImageEntry> images(const std::string& topic) = 0;
  virtual std::vector<ImuSample> imu(const std::string& topic) = 0;
  virtual std::vector<StampedPose> poses(const std::string& topic) = 0;

  /** The image of an entry of that topic. */
  virtual BagImage image(const std::string& topic, size_t handle) = 0;
};

}  // namespace etalon
