#include <fastcdr/Cdr.h>
#include <sqlite3.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <filesystem>
#include <limits>
#include <stdexcept>
#include <vector>

#include "bags/bag_writer.h"
#include "etalon/core/errors.h"
#include "etalon/core/output_file.h"

namespace etalon {

namespace {

namespace cdr = eprosima::fastcdr;
namespace fs = std::filesystem;

/** A message in CDR, member by member; it begins with a std_msgs/Header. */
class CdrMessage {
 public:
  CdrMessage(TimeNs t, const std::string& frame)
      : cdr_(buffer_, cdr::Cdr::LITTLE_ENDIANNESS, cdr::Cdr::DDS_CDR) {
    cdr_.serialize_encapsulation();
    *this << static_cast<std::int32_t>(t / kNanosecondsPerSecond)
          << static_cast<std::uint32_t>(t % kNanosecondsPerSecond) << frame;
  }

  template <typename T>
  CdrMessage& operator<<(const T& value) {
    cdr_ << value;
    return *this;
  }

  CdrMessage& operator<<(const Eigen::Vector3d& v) {
    return *this << std::array<double, 3>{v.x(), v.y(), v.z()};
  }

  CdrMessage& operator<<(const Eigen::Quaterniond& q) {
    return *this << std::array<double, 4>{q.x(), q.y(), q.z(), q.w()};
  }

  CdrMessage& operator<<(const cv::Mat& gray) {
    *this << static_cast<std::uint32_t>(gray.total());
    for (int y = 0; y < gray.rows; ++y) cdr_.serializeArray(gray.ptr(y), gray.cols);
    return *this;
  }

  const char* data() { return buffer_.getBuffer(); }
  size_t size() const { return cdr_.getSerializedDataLength(); }

 private:
  cdr::FastBuffer buffer_;
  cdr::Cdr cdr_;
};

struct Topic {
  std::string name, type;
  size_t messages = 0;
};

/** Tables and metadata as rosbag2_storage_sqlite3 of Humble has them: schema 3, metadata 5. */
class Ros2BagWriter : public BagWriter {
 public:
  explicit Ros2BagWriter(const std::string& path) : path_(path) {
    if (sqlite3_open(path.c_str(), &database_) != SQLITE_OK) fail();
    // An interrupted bag is thrown away.
    run("PRAGMA journal_mode = OFF; PRAGMA synchronous = OFF;"
        "CREATE TABLE schema(schema_version INTEGER PRIMARY KEY, ros_distro TEXT NOT NULL);"
        "INSERT INTO schema VALUES(3, 'humble');"
        "CREATE TABLE metadata(id INTEGER PRIMARY KEY, metadata_version INTEGER NOT NULL,"
        " metadata TEXT NOT NULL);"
        "CREATE TABLE topics(id INTEGER PRIMARY KEY, name TEXT NOT NULL, type TEXT NOT NULL,"
        " serialization_format TEXT NOT NULL, offered_qos_profiles TEXT NOT NULL);"
        "CREATE TABLE messages(id INTEGER PRIMARY KEY, topic_id INTEGER NOT NULL,"
        " timestamp INTEGER NOT NULL, data BLOB NOT NULL);"
        "CREATE INDEX timestamp_idx ON messages (timestamp ASC); BEGIN");
    for (size_t i = 0; i < topics_.size(); ++i)
      run("INSERT INTO topics VALUES(" + std::to_string(i + 1) + ", '" + topics_[i].name + "', '" +
          topics_[i].type + "', 'cdr', '')");
    if (sqlite3_prepare_v2(database_,
                           "INSERT INTO messages(topic_id, timestamp, data) VALUES(?1, ?2, ?3)", -1,
                           &insert_, nullptr) != SQLITE_OK)
      fail();
  }
  ~Ros2BagWriter() override {
    sqlite3_finalize(insert_);
    sqlite3_close(database_);
  }
  Ros2BagWriter(const Ros2BagWriter&) = delete;
  Ros2BagWriter& operator=(const Ros2BagWriter&) = delete;

  void write(const ImuSample& sample) override {
    std::array<double, 9> none{}, unknown{};  // sensor_msgs/Imu: -1 where there is no orientation
    none[0] = -1.0;
    CdrMessage message(sample.t, "imu0");
    message << Eigen::Quaterniond::Identity() << none << sample.gyro << unknown << sample.accel
            << unknown;
    put(kImu, sample.t, &message);
  }

  void write(const StereoFrame& frame) override {
    put(kLeft, frame.t, "cam0", frame.left);
    put(kRight, frame.t, "cam1", frame.right);
  }

  void write(const StampedState& state) override {
    CdrMessage message(state.t, "world");
    message << state.T_WB.t << Eigen::Quaterniond(state.T_WB.R);
    put(kTruth, state.t, &message);
  }

  void close() override {
    run("COMMIT");
    writeFile((fs::path(path_).parent_path() / "metadata.yaml").string(), metadata());
  }

 private:
  enum TopicIndex : size_t { kLeft, kRight, kImu, kTruth };

  void put(TopicIndex topic, TimeNs t, const std::string& frame, const cv::Mat& gray) {
    CdrMessage message(t, frame);
    message << static_cast<std::uint32_t>(gray.rows) << static_cast<std::uint32_t>(gray.cols)
            << std::string("mono8") << std::uint8_t{0} << static_cast<std::uint32_t>(gray.cols)
            << gray;
    put(topic, t, &message);
  }

  void put(TopicIndex topic, TimeNs t, CdrMessage* message) {
    if (t < 0 || t / kNanosecondsPerSecond > std::numeric_limits<std::int32_t>::max())
      throw DataError(path_, 0, "a ROS 2 bag cannot hold the stamp " + std::to_string(t) + " ns");
    sqlite3_bind_int64(insert_, 1, static_cast<sqlite3_int64>(topic) + 1);
    sqlite3_bind_int64(insert_, 2, t);
    sqlite3_bind_blob64(insert_, 3, message->data(), message->size(), SQLITE_STATIC);
    const bool done = sqlite3_step(insert_) == SQLITE_DONE;
    if (!done) fail();
    sqlite3_reset(insert_);
    first_ = std::min(first_, t);
    last_ = std::max(last_, t);
    ++topics_[topic].messages;
  }

  std::string metadata() const {
    size_t all = 0;
    std::string topics;
    for (const Topic& topic : topics_) {
      all += topic.messages;
      topics += "    - topic_metadata:\n        name: " + topic.name +
                "\n        type: " + topic.type +
                "\n        serialization_format: cdr\n        offered_qos_profiles: \"\"\n"
                "      message_count: " +
                std::to_string(topic.messages) + "\n";
    }
    const auto interval = [&](const std::string& indent) {
      return indent + "duration:\n" + indent +
             "  nanoseconds: " + std::to_string(all > 0 ? last_ - first_ : 0) + "\n" + indent +
             "starting_time:\n" + indent +
             "  nanoseconds_since_epoch: " + std::to_string(all > 0 ? first_ : 0) + "\n" + indent +
             "message_count: " + std::to_string(all) + "\n";
    };
    const std::string name = fs::path(path_).filename().string();
    return "rosbag2_bagfile_information:\n  version: 5\n  storage_identifier: sqlite3\n" +
           interval("  ") + "  topics_with_message_count:\n" + topics +
           "  compression_format: \"\"\n  compression_mode: \"\"\n  relative_file_paths:\n    - " +
           name + "\n  files:\n    - path: " + name + "\n" + interval("      ");
  }

  void run(const std::string& sql) {
    if (sqlite3_exec(database_, sql.c_str(), nullptr, nullptr, nullptr) != SQLITE_OK) fail();
  }

  [[noreturn]] void fail() const { throw std::runtime_error(sqlite3_errmsg(database_)); }

  std::string path_;
  sqlite3* database_ = nullptr;
  sqlite3_stmt* insert_ = nullptr;
  std::vector<Topic> topics_ = {{kBagImageTopics[0], "sensor_msgs/msg/Image"},
                                {kBagImageTopics[1], "sensor_msgs/msg/Image"},
                                {kBagImuTopic, "sensor_msgs/msg/Imu"},
                                {kTruthTopic, "geometry_msgs/msg/PoseStamped"}};
  TimeNs first_ = std::numeric_limits<TimeNs>::max(), last_ = 0;
};

}  // namespace

std::unique_ptr<BagWriter> createRos2Bag(const std::string& path) {
  return std::make_unique<Ros2BagWriter>(path);
}

}  // namespace etalon
