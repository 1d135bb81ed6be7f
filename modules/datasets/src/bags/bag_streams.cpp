#include "bags/bag_streams.h"

#include <algorithm>

#include "etalon/core/errors.h"
#include "etalon/core/parameters.h"
#include "etalon/core/printable.h"

namespace etalon {

namespace {

class Chooser {
 public:
  Chooser(const std::vector<BagTopic>& topics, const std::string& path)
      : topics_(topics), path_(path) {}

  BagStreams choose(const RecordingOptions& options, const KalibrTopics& kalibr) const {
    BagStreams streams;
    const std::vector<std::string> images = {kImageType, kCompressedImageType};
    streams.left = given(options.left_topic, kalibr.left, images, "images of the left camera");
    streams.right = given(options.right_topic, kalibr.right, images, "images of the right camera");
    if (streams.left.empty() || streams.right.empty()) chooseCameras(&streams);
    if (streams.left == streams.right)
      fail("expected two topics of images, found '" + streams.left + "' twice");
    streams.imu = given(options.imu_topic, kalibr.imu, {kImuType}, "samples of the IMU");
    if (streams.imu.empty()) streams.imu = onlyOne(kImuType, "of the IMU, --imu-topic");
    streams.truth = given(options.truth_topic, kTruthTopic, {kPoseType}, "poses of the IMU");
    return streams;
  }

 private:
  /** The topic of the option, which must be there; else the hint, if it is there; else nothing. */
  std::string given(const std::string& option, const std::string& hint,
                    const std::vector<std::string>& types, const std::string& what) const {
    const auto fits = [&](const BagTopic& topic, const std::string& name) {
      return topic.name == name && std::find(types.begin(), types.end(), topic.type) != types.end();
    };
    for (const std::string& name : {option, hint}) {
      if (name.empty()) continue;
      for (const BagTopic& topic : topics_)
        if (fits(topic, name)) return name;
      if (name != option) continue;
      std::vector<std::string> names;
      for (const BagTopic& topic : topics_) names.push_back(topic.name);
      const std::string nearest = nearestWord(name, names);
      std::string message = "there are no " + what;
      message.append(" (")
          .append(types.front())
          .append(") on the topic '")
          .append(name)
          .append("'");
      if (!nearest.empty() && nearest != name)
        message.append(" (did you mean '").append(nearest).append("'?)");
      fail(message);
    }
    return "";
  }

  void chooseCameras(BagStreams* streams) const {
    for (const char* type : {kImageType, kCompressedImageType}) {
      const std::vector<std::string> names = ofType(type);
      if (names.empty()) continue;
      if (names.size() != 2) break;
      // One that is given leaves the other.
      if (streams->left.empty()) streams->left = names[streams->right == names[0] ? 1 : 0];
      if (streams->right.empty()) streams->right = names[streams->left == names[1] ? 0 : 1];
      return;
    }
    fail("expected two topics of images, or --left-topic and --right-topic");
  }

  std::string onlyOne(const std::string& type, const std::string& what) const {
    const std::vector<std::string> names = ofType(type);
    if (names.size() != 1) fail("expected one topic " + what);
    return names.front();
  }

  std::vector<std::string> ofType(const std::string& type) const {
    std::vector<std::string> names;
    for (const BagTopic& topic : topics_)
      if (topic.type == type) names.push_back(topic.name);
    return names;
  }

  [[noreturn]] void fail(const std::string& message) const {
    std::string list;
    for (const BagTopic& topic : topics_)
      list += (list.empty() ? "" : ", ") + topic.name + " (" + topic.type + ", " +
              std::to_string(topic.messages) + ")";
    throw DataError(path_, 0, printable(message + "; topics: " + (list.empty() ? "none" : list)));
  }

  const std::vector<BagTopic>& topics_;
  const std::string& path_;
};

}  // namespace

BagStreams chooseStreams(const std::vector<BagTopic>& topics, const RecordingOptions& options,
                         const KalibrTopics& kalibr, const std::string& path) {
  return Chooser(topics, path).choose(options, kalibr);
}

}  // namespace etalon
