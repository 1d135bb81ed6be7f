#include <geometry_msgs/PoseStamped.h>
#include <rosbag/bag.h>
#include <sensor_msgs/Image.h>
#include <sensor_msgs/Imu.h>

#include <Eigen/Geometry>
#include <array>
#include <filesystem>
#include <fstream>
#include <sstream>

#include "bags/bag_streams.h"
#include "calibration/kalibr_text.h"
#include "etalon/core/errors.h"
#include "etalon/core/output_file.h"
#include "event_writer.h"

namespace etalon {

namespace {

namespace fs = std::filesystem;

const std::array<std::string, 2> kImageTopics = {"/cam0/image_raw", "/cam1/image_raw"};
constexpr const char* kImuTopic = "/imu0";

std_msgs::Header headerOf(TimeNs t, const std::string& frame) {
  std_msgs::Header header;
  header.stamp.fromNSec(static_cast<std::uint64_t>(t));
  header.frame_id = frame;
  return header;
}

sensor_msgs::Image imageOf(TimeNs t, const std::string& frame, const cv::Mat& gray) {
  sensor_msgs::Image image;
  image.header = headerOf(t, frame);
  image.width = gray.cols;
  image.height = gray.rows;
  image.step = gray.cols;
  image.encoding = "mono8";
  image.data.reserve(gray.total());
  for (int y = 0; y < gray.rows; ++y)
    image.data.insert(image.data.end(), gray.ptr(y), gray.ptr(y) + gray.cols);
  return image;
}

template <typename Vector>
void assign(const Eigen::Vector3d& from, Vector* to) {
  to->x = from.x();
  to->y = from.y();
  to->z = from.z();
}

class BagWriter : public EventWriter {
 public:
  explicit BagWriter(const std::string& path) : path_(path) {
    bag_.open(path, rosbag::bagmode::Write);
  }

  void write(const ImuSample& sample) override {
    sensor_msgs::Imu imu;
    imu.header = headerOf(sample.t, "imu0");
    imu.orientation_covariance[0] = -1.0;  // sensor_msgs/Imu: there is no orientation
    assign(sample.gyro, &imu.angular_velocity);
    assign(sample.accel, &imu.linear_acceleration);
    put(kImuTopic, imu);
  }

  void write(const StereoFrame& frame) override {
    put(kImageTopics[0], imageOf(frame.t, "cam0", frame.left));
    put(kImageTopics[1], imageOf(frame.t, "cam1", frame.right));
  }

  void write(const StampedState& state) {
    geometry_msgs::PoseStamped pose;
    pose.header = headerOf(state.t, "world");
    assign(state.T_WB.t, &pose.pose.position);
    const Eigen::Quaterniond q(state.T_WB.R);
    pose.pose.orientation.w = q.w();
    pose.pose.orientation.x = q.x();
    pose.pose.orientation.y = q.y();
    pose.pose.orientation.z = q.z();
    put(kTruthTopic, pose);
  }

  void close() { bag_.close(); }

 private:
  /** Recorded at the instant of its stamp. */
  template <typename Message>
  void put(const std::string& topic, const Message& message) {
    if (message.header.stamp.isZero())
      throw DataError(path_, 0, "a ROS 1 bag cannot hold the stamp 0");
    bag_.write(topic, message.header.stamp, message);
  }

  std::string path_;
  rosbag::Bag bag_;
};

void requireNoOther(const fs::path& file, const std::string& text) {
  std::ifstream in(file, std::ios::binary);
  if (!in) return;
  std::ostringstream there;
  there << in.rdbuf();
  if (there.str() != text)
    throw ConfigError(file.string() +
                      ": the calibration of another recording is there; expected a folder of its "
                      "own for the bag");
}

}  // namespace

ConvertReport convertToRosBag(SensorSource& source, const std::string& dst,
                              const ConvertOptions& options) {
  const fs::path bag = fs::absolute(dst).lexically_normal();
  const std::string camchain = camchainText(source.calibration(), kImageTopics);
  const std::string imu = kalibrImuText(source.calibration().imu, kImuTopic);
  requireNoOther(bag.parent_path() / "camchain.yaml", camchain);
  requireNoOther(bag.parent_path() / "imu.yaml", imu);
  OutputFiles files(bag.parent_path().string());
  writeFile(files.path("camchain.yaml"), camchain);
  writeFile(files.path("imu.yaml"), imu);
  ConvertReport report;
  try {
    BagWriter writer(files.path(bag.filename().string()));
    report = writeEvents(source, options, &writer);
    for (const StampedState& state : source.groundTruth().states) writer.write(state);
    writer.close();
  } catch (const Error&) {
    throw;
  } catch (const std::exception& e) {
    throw DataError(dst, 0, std::string("the bag cannot be written: ") + e.what());
  }
  files.putInPlace();
  return report;
}

}  // namespace etalon
