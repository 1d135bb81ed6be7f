#include "bags/ros1_bag.h"

#include <geometry_msgs/PoseStamped.h>
#include <rosbag/bag.h>
#include <rosbag/view.h>
#include <sensor_msgs/CompressedImage.h>
#include <sensor_msgs/Image.h>
#include <sensor_msgs/Imu.h>

#include <Eigen/Geometry>
#include <fstream>
#include <map>

#include "bags/bag_poses.h"
#include "bags/ros1_structure.h"
#include "etalon/core/errors.h"

namespace etalon {

namespace {

TimeNs stampOf(const std_msgs::Header& header) {
  return static_cast<TimeNs>(header.stamp.toNSec());
}

class Ros1Bag : public BagFile {
 public:
  explicit Ros1Bag(const std::string& path) : path_(path) {
    checkRos1Structure(path);
    guarded([&] {
      bag_.open(path_, rosbag::bagmode::Read);
      rosbag::View view(bag_);
      for (const rosbag::ConnectionInfo* connection : view.getConnections()) {
        BagTopic& topic = topics_[connection->topic];
        topic.name = connection->topic;
        topic.type = connection->datatype;
      }
      for (auto& [name, topic] : topics_)
        topic.messages = rosbag::View(bag_, rosbag::TopicQuery(name)).size();
    });
  }

  std::vector<BagTopic> topics() const override {
    std::vector<BagTopic> topics;
    for (const auto& [name, topic] : topics_) topics.push_back(topic);
    return topics;
  }

  std::vector<std::string> files() const override { return {path_}; }

  std::vector<BagImageEntry> images(const std::string& topic) override {
    std::vector<BagImageEntry> entries;
    std::vector<rosbag::MessageInstance>& kept = images_[topic];
    each(topic, [&](const rosbag::MessageInstance& message) {
      entries.push_back({stampOf(headerOf(message)), kept.size()});
      kept.push_back(message);
    });
    return entries;
  }

  std::vector<ImuSample> imu(const std::string& topic) override {
    std::vector<ImuSample> samples;
    each(topic, [&](const rosbag::MessageInstance& message) {
      const auto imu = as<sensor_msgs::Imu>(message);
      const auto& w = imu->angular_velocity;
      const auto& a = imu->linear_acceleration;
      samples.push_back({stampOf(imu->header), {w.x, w.y, w.z}, {a.x, a.y, a.z}});
    });
    return samples;
  }

  std::vector<StampedPose> poses(const std::string& topic) override {
    std::vector<StampedPose> poses;
    each(topic, [&](const rosbag::MessageInstance& message) {
      const auto pose = as<geometry_msgs::PoseStamped>(message);
      const auto& p = pose->pose.position;
      const auto& q = pose->pose.orientation;
      poses.push_back(
          {stampOf(pose->header), poseOfMessage({p.x, p.y, p.z}, {q.w, q.x, q.y, q.z}, path_)});
    });
    return poses;
  }

  BagImage image(const std::string& topic, size_t handle) override {
    BagImage result;
    guarded([&] {
      const rosbag::MessageInstance& message = images_.at(topic).at(handle);
      result.compressed = message.getDataType() == kCompressedImageType;
      if (result.compressed) {
        const auto image = as<sensor_msgs::CompressedImage>(message);
        result.encoding = image->format;
        result.data = std::move(image->data);
        return;
      }
      const auto image = as<sensor_msgs::Image>(message);
      result.encoding = image->encoding;
      result.width = image->width;
      result.height = image->height;
      result.step = image->step;
      result.big_endian = image->is_bigendian != 0;
      result.data = std::move(image->data);
    });
    return result;
  }

 private:
  /** Exceptions of ROS as ours. */
  template <typename Act>
  void guarded(Act act) const {
    try {
      act();
    } catch (const Error&) {
      throw;
    } catch (const std::exception& e) {
      throw DataError(path_, 0, std::string("expected a ROS 1 bag: ") + e.what());
    }
  }

  template <typename Act>
  void each(const std::string& topic, Act act) {
    guarded([&] {
      rosbag::View view(bag_, rosbag::TopicQuery(topic));
      for (const rosbag::MessageInstance& message : view) act(message);
    });
  }

  template <typename Message>
  boost::shared_ptr<Message> as(const rosbag::MessageInstance& message) const {
    boost::shared_ptr<Message> result = message.instantiate<Message>();
    if (!result)
      throw DataError(path_, 0,
                      "topic '" + message.getTopic() + "': expected messages " +
                          ros::message_traits::DataType<Message>::value() +
                          " as ROS 1 defines them, found another definition of " +
                          message.getDataType());
    return result;
  }

  /** The header alone, which is what messages with a header begin with. */
  std_msgs::Header headerOf(const rosbag::MessageInstance& message) {
    buffer_.resize(message.size());
    ros::serialization::OStream out(buffer_.data(), buffer_.size());
    message.write(out);
    std_msgs::Header header;
    ros::serialization::IStream in(buffer_.data(), buffer_.size());
    ros::serialization::deserialize(in, header);
    return header;
  }

  std::string path_;
  rosbag::Bag bag_;
  std::map<std::string, BagTopic> topics_;
  std::map<std::string, std::vector<rosbag::MessageInstance>> images_;  ///< by topic
  std::vector<std::uint8_t> buffer_;
};

}  // namespace

std::unique_ptr<BagFile> openRos1Bag(const std::string& path) {
  return std::make_unique<Ros1Bag>(path);
}

bool isRos1Bag(const std::string& path) {
  constexpr char kMagic[] = "#ROSBAG V";
  std::string start(sizeof kMagic - 1, '\0');
  std::ifstream in(path, std::ios::binary);
  return in.read(start.data(), static_cast<std::streamsize>(start.size())) && start == kMagic;
}

}  // namespace etalon
