#include <geometry_msgs/PoseStamped.h>
#include <rosbag/bag.h>
#include <sensor_msgs/Image.h>
#include <sensor_msgs/Imu.h>

#include <Eigen/Geometry>

#include "bags/bag_writer.h"
#include "etalon/core/errors.h"

namespace etalon {

namespace {

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

class Ros1BagWriter : public BagWriter {
 public:
  explicit Ros1BagWriter(const std::string& path) : path_(path) {
    bag_->open(path, rosbag::bagmode::Write);
  }
  /** rosbag::Bag closes itself in its destructor, where an exception ends the process: on a full
   * disk it is never destroyed. */
  ~Ros1BagWriter() override {
    try {
      bag_->close();
    } catch (const std::exception&) {
      bag_.release();  // NOLINT(bugprone-unused-return-value)
    }
  }
  Ros1BagWriter(const Ros1BagWriter&) = delete;
  Ros1BagWriter& operator=(const Ros1BagWriter&) = delete;

  void write(const ImuSample& sample) override {
    sensor_msgs::Imu imu;
    imu.header = headerOf(sample.t, "imu0");
    imu.orientation_covariance[0] = -1.0;  // sensor_msgs/Imu: there is no orientation
    assign(sample.gyro, &imu.angular_velocity);
    assign(sample.accel, &imu.linear_acceleration);
    put(kBagImuTopic, imu);
  }

  void write(const StereoFrame& frame) override {
    put(kBagImageTopics[0], imageOf(frame.t, "cam0", frame.left));
    put(kBagImageTopics[1], imageOf(frame.t, "cam1", frame.right));
  }

  void write(const StampedState& state) override {
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

  void close() override { bag_->close(); }

 private:
  /** Recorded at the instant of its stamp. */
  template <typename Message>
  void put(const std::string& topic, const Message& message) {
    if (message.header.stamp.isZero())
      throw DataError(path_, 0, "a ROS 1 bag cannot hold the stamp 0");
    bag_->write(topic, message.header.stamp, message);
  }

  std::string path_;
  std::unique_ptr<rosbag::Bag> bag_ = std::make_unique<rosbag::Bag>();
};

}  // namespace

std::unique_ptr<BagWriter> createRos1Bag(const std::string& path) {
  return std::make_unique<Ros1BagWriter>(path);
}

}  // namespace etalon
