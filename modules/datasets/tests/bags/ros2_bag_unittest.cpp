// Bags of ROS 2. Stock rosbag2 is not to be had in Debian: these are written with its tables and
// metadata as ROS 2 Humble has them, and eProsima's CDR, and what convert writes is held against
// them.

#include "bags/ros2_bag.h"

#include <fastcdr/Cdr.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sqlite3.h>
#include <yaml-cpp/yaml.h>

#include <Eigen/Geometry>
#include <array>

#include "bags/bag_writer.h"
#include "etalon/core/errors.h"
#include "rawlog/rawlog_test.h"

namespace etalon::testing {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
namespace cdr = eprosima::fastcdr;

/** A message, member by member. */
class Message {
 public:
  Message(TimeNs t, cdr::Cdr::Endianness endianness)
      : cdr_(buffer_, endianness, cdr::Cdr::DDS_CDR) {
    cdr_.serialize_encapsulation();
    *this << static_cast<std::int32_t>(t / kNanosecondsPerSecond)
          << static_cast<std::uint32_t>(t % kNanosecondsPerSecond) << std::string("a frame");
  }
  template <typename T>
  Message& operator<<(const T& value) {
    cdr_ << value;
    return *this;
  }
  std::string data() const { return {buffer_.getBuffer(), cdr_.getSerializedDataLength()}; }

 private:
  cdr::FastBuffer buffer_;
  cdr::Cdr cdr_;
};

/** One sqlite3 file of a bag. */
class BagWriter {
 public:
  explicit BagWriter(const fs::path& path) {
    EXPECT_EQ(sqlite3_open(path.c_str(), &database_), SQLITE_OK);
    run("PRAGMA synchronous = OFF");  // it need not survive a power cut
    run("PRAGMA journal_mode = OFF");
    run("CREATE TABLE schema(schema_version INTEGER PRIMARY KEY, ros_distro TEXT NOT NULL)");
    run("CREATE TABLE topics(id INTEGER PRIMARY KEY, name TEXT NOT NULL, type TEXT NOT NULL,"
        " serialization_format TEXT NOT NULL, offered_qos_profiles TEXT NOT NULL)");
    run("CREATE TABLE messages(id INTEGER PRIMARY KEY, topic_id INTEGER NOT NULL,"
        " timestamp INTEGER NOT NULL, data BLOB NOT NULL)");
    run("CREATE INDEX timestamp_idx ON messages (timestamp ASC)");
    run("BEGIN");
  }
  ~BagWriter() {
    run("COMMIT");
    sqlite3_close(database_);
  }

  void topic(int id, const std::string& name, const std::string& type,
             const std::string& format = "cdr") const {
    run("INSERT INTO topics VALUES(" + std::to_string(id) + ", '" + name + "', '" + type + "', '" +
        format + "', '')");
  }

  void put(int topic, TimeNs recorded, const std::string& data) const {
    sqlite3_stmt* statement = nullptr;
    sqlite3_prepare_v2(database_,
                       "INSERT INTO messages(topic_id, timestamp, data) VALUES(?1, ?2, ?3)", -1,
                       &statement, nullptr);
    sqlite3_bind_int(statement, 1, topic);
    sqlite3_bind_int64(statement, 2, recorded);
    sqlite3_bind_blob(statement, 3, data.data(), static_cast<int>(data.size()), SQLITE_TRANSIENT);
    EXPECT_EQ(sqlite3_step(statement), SQLITE_DONE);
    sqlite3_finalize(statement);
  }

  void run(const std::string& sql) const {
    EXPECT_EQ(sqlite3_exec(database_, sql.c_str(), nullptr, nullptr, nullptr), SQLITE_OK)
        << sqlite3_errmsg(database_);
  }

 private:
  sqlite3* database_ = nullptr;
};

constexpr const char* kMetadata = R"(rosbag2_bagfile_information:
  version: 5
  storage_identifier: sqlite3
  duration:
    nanoseconds: 300000000
  message_count: 100
  compression_format: ""
  compression_mode: ""
  relative_file_paths:
    - flight_0.db3
    - flight_1.db3
)";

class Ros2Bag : public ::testing::Test {
 protected:
  Ros2Bag() {
    writeTinyRecording(euroc_);
    convertToRosBag(*openWhole(euroc_.string()), (folder_ / "flight.bag").string());
    fs::create_directory(bag_);
    writeText(bag_ / "metadata.yaml", kMetadata);
    writeSplit();
  }

  /** The tiny recording, the first half in one file and the second one in another. */
  void writeSplit() const {
    const auto source = openWhole(euroc_.string());
    const std::vector<SensorEvent> events = readAll(*source);
    const BagWriter first(bag_ / "flight_0.db3"), second(bag_ / "flight_1.db3");
    for (const BagWriter* part : {&first, &second}) {
      const int shift = part == &second ? 10 : 0;  // topics have other numbers there
      part->topic(1 + shift, "/cam0/image_raw", "sensor_msgs/msg/Image");
      part->topic(2 + shift, "/cam1/image_raw", "sensor_msgs/msg/Image");
      part->topic(3 + shift, "/imu0", "sensor_msgs/msg/Imu");
      part->topic(4 + shift, "/ground_truth", "geometry_msgs/msg/PoseStamped");
    }
    for (size_t i = 0; i < events.size(); ++i) {
      const bool late = 2 * i > events.size();
      put(late ? second : first, late ? 10 : 0, events[i]);
    }
    for (const StampedState& state : source->groundTruth().states) {
      const Eigen::Vector3d& p = state.T_WB.t;
      const Eigen::Quaterniond q(state.T_WB.R);
      first.put(4, state.t,
                (Message(state.t, kLittle) << std::array<double, 3>{p.x(), p.y(), p.z()}
                                           << std::array<double, 4>{q.x(), q.y(), q.z(), q.w()})
                    .data());
    }
  }

  static constexpr auto kLittle = cdr::Cdr::LITTLE_ENDIANNESS;

  static std::string imageOf(TimeNs t, const cv::Mat& gray, std::uint32_t claimed_size) {
    Message message(t, kLittle);
    message << static_cast<std::uint32_t>(gray.rows) << static_cast<std::uint32_t>(gray.cols)
            << std::string("mono8") << std::uint8_t{0} << static_cast<std::uint32_t>(gray.cols)
            << claimed_size;
    return message.data() + std::string(gray.datastart, gray.dataend);
  }

  static std::string imuOf(const ImuSample& sample, cdr::Cdr::Endianness endianness) {
    const auto array = [](const Eigen::Vector3d& v) {
      return std::array<double, 3>{v.x(), v.y(), v.z()};
    };
    const std::array<double, 9> covariance{};
    Message message(sample.t, endianness);
    message << std::array<double, 4>{0, 0, 0, 1} << covariance << array(sample.gyro) << covariance
            << array(sample.accel) << covariance;
    return message.data();
  }

  static void put(const BagWriter& writer, int shift, const SensorEvent& event) {
    const TimeNs recorded = stampOf(event) + 1'000'000;
    if (const auto* sample = std::get_if<ImuSample>(&event)) {
      // Drivers of both kinds of machines.
      const bool big = sample->t / 5'000'000 % 2 == 0;
      writer.put(3 + shift, recorded, imuOf(*sample, big ? cdr::Cdr::BIG_ENDIANNESS : kLittle));
      return;
    }
    const StereoFrame& frame = std::get<StereoFrame>(event);
    writer.put(1 + shift, recorded, imageOf(frame.t, frame.left, frame.left.total()));
    writer.put(2 + shift, recorded, imageOf(frame.t, frame.right, frame.right.total()));
  }

  std::string openingError(const std::string& path) const {
    return dataErrorOf([&] { openSource(path); });
  }

  TemporaryFolder folder_;
  const fs::path euroc_ = folder_ / "recording", bag_ = folder_ / "flight";
};

TEST_F(Ros2Bag, HoldsTheSameAsThatOfRos1) {
  const auto ros1 = openWhole((folder_ / "flight.bag").string()), ros2 = openWhole(bag_.string());
  EXPECT_THAT(ros2->statistics().warnings, IsEmpty());
  expectSameRecording(*ros1, *ros2);
  EXPECT_EQ(ros2->kind(), "rosbag");
}

TEST_F(Ros2Bag, IsAFileToo) {
  SourceOptions options;
  options.recording.camchain = (folder_ / "camchain.yaml").string();
  const auto source = openSource((bag_ / "flight_0.db3").string(), options);
  EXPECT_GT(source->imageStamps().size(), 0u);
  EXPECT_LT(source->imageStamps().size(), static_cast<size_t>(kFrames));
  EXPECT_EQ(source->imageStamps().front(), frameStamp(0));
}

TEST_F(Ros2Bag, WrittenOnesHoldTheSame) {
  const std::string file = (folder_ / "written/flight_0.db3").string();
  for (int time = 0; time < 2; ++time) {  // again in place of the first
    const ConvertReport report = convertToRos2Bag(*openWhole(euroc_.string()), file);
    EXPECT_EQ(report.stereo_frames, kFrames);
    const auto expected = openWhole(bag_.string());
    const auto written = openWhole((folder_ / "written").string());
    EXPECT_THAT(written->statistics().warnings, IsEmpty());
    expectSameRecording(*expected, *written);
  }
  const auto bag = openRos2Bag((folder_ / "written").string());
  const auto other = openRos2Bag(bag_.string());
  EXPECT_EQ(bag->files().size(), 2u);
  for (size_t i = 0; i < 4; ++i) {
    EXPECT_EQ(bag->topics()[i].name, other->topics()[i].name);
    EXPECT_EQ(bag->topics()[i].type, other->topics()[i].type);
    EXPECT_EQ(bag->topics()[i].messages, other->topics()[i].messages);
  }
}

TEST_F(Ros2Bag, AWrittenOneDescribesItself) {
  convertToRos2Bag(*openWhole(euroc_.string()), (folder_ / "written/flight_0.db3").string());
  const YAML::Node metadata = YAML::LoadFile((folder_ / "written/metadata.yaml").string());
  const YAML::Node about = metadata["rosbag2_bagfile_information"];
  const auto bag = openRos2Bag((folder_ / "written").string());
  size_t messages = 0;
  ASSERT_EQ(about["topics_with_message_count"].size(), 4u);
  for (const YAML::Node& topic : about["topics_with_message_count"])
    messages += topic["message_count"].as<size_t>();
  for (const BagTopic& topic : bag->topics()) messages -= topic.messages;
  EXPECT_EQ(messages, 0u);
  const std::vector<ImuSample> imu = bag->imu("/imu0");
  for (const YAML::Node& part : {about, about["files"][0]}) {
    const auto start = part["starting_time"]["nanoseconds_since_epoch"].as<TimeNs>();
    EXPECT_EQ(start, imu.front().t);
    EXPECT_GE(start + part["duration"]["nanoseconds"].as<TimeNs>(), imu.back().t);
  }
  EXPECT_EQ(about["relative_file_paths"][0].as<std::string>(), "flight_0.db3");
}

TEST_F(Ros2Bag, IsNotWrittenBesideAnother) {
  EXPECT_THROW(convertToRos2Bag(*openWhole(euroc_.string()), (bag_ / "flight_2.db3").string()),
               ConfigError);
  EXPECT_FALSE(fs::exists(bag_ / "flight_2.db3"));
}

TEST_F(Ros2Bag, StampsThatItCannotHoldAreRefused) {
  const auto writer = createRos2Bag((folder_ / "late.db3").string());
  EXPECT_THROW(writer->write(ImuSample{-1, {}, {}}), DataError);
  EXPECT_THROW(writer->write(ImuSample{3'000'000'000 * kNanosecondsPerSecond, {}, {}}), DataError);
}

TEST_F(Ros2Bag, FilesAndTopicsAreCounted) {
  const auto bag = openRos2Bag(bag_.string());
  EXPECT_EQ(bag->files().size(), 3u);
  ASSERT_EQ(bag->topics().size(), 4u);
  EXPECT_EQ(bag->topics()[0].name, "/cam0/image_raw");
  EXPECT_EQ(bag->topics()[0].type, "sensor_msgs/Image");
  EXPECT_EQ(bag->topics()[0].messages, static_cast<size_t>(kFrames));
}

TEST_F(Ros2Bag, OtherStoragesAreRefusedWithAnAdvice) {
  const std::string mcap = (folder_ / "flight.mcap").string();
  writeText(mcap, "\x89MCAP0\r\nand so on");
  EXPECT_THAT(openingError(mcap),
              AllOf(HasSubstr(mcap), HasSubstr("MCAP is not read"), HasSubstr("ros2 bag convert")));
  replaceInFile(bag_ / "metadata.yaml", "storage_identifier: sqlite3", "storage_identifier: mcap");
  EXPECT_THAT(openingError(bag_.string()),
              AllOf(HasSubstr("metadata.yaml:3: "), HasSubstr("'mcap' is not read")));
  writeText(bag_ / "metadata.yaml", kMetadata);
  replaceInFile(bag_ / "metadata.yaml", "compression_format: \"\"", "compression_format: zstd");
  EXPECT_THAT(openingError(bag_.string()),
              AllOf(HasSubstr("metadata.yaml:7: "), HasSubstr("'zstd' is not read")));
}

TEST_F(Ros2Bag, AFolderOfImagesMayHaveMetadataOfItsOwn) {
  writeText(euroc_ / "metadata.yaml", "place: machine hall\n");
  EXPECT_EQ(openRecording(euroc_.string())->kind(), "euroc");
  // Without images the folder is a bag, and what its metadata lack is said.
  writeText(bag_ / "metadata.yaml", "place: machine hall\n");
  EXPECT_THAT(openingError(bag_.string()), HasSubstr("rosbag2_bagfile_information"));
}

TEST_F(Ros2Bag, BrokenOnesAreRefused) {
  replaceInFile(bag_ / "metadata.yaml", "flight_1.db3", "flight_2.db3");
  EXPECT_THAT(openingError(bag_.string()),
              AllOf(HasSubstr("flight_2.db3"), HasSubstr("expected a ROS 2 bag")));
  writeText(bag_ / "metadata.yaml",
            "rosbag2_bagfile_information:\n  storage_identifier: sqlite3\n");
  EXPECT_THAT(openingError(bag_.string()), HasSubstr("'rosbag2_bagfile_information.relative_file"));

  const std::string text = (folder_ / "text.db3").string();
  writeText(text, std::string("SQLite format 3\0", 16) + std::string(2000, 'x'));
  EXPECT_THAT(openingError(text), HasSubstr("expected a ROS 2 bag: "));
  const fs::path other = folder_ / "other.db3";
  { const BagWriter writer(other); }
  EXPECT_THAT(openingError(other.string()), HasSubstr("topics: none"));
  {
    const BagWriter writer(folder_ / "json.db3");
    writer.topic(1, "/imu0", "sensor_msgs/msg/Imu", "json");
  }
  EXPECT_THAT(openingError((folder_ / "json.db3").string()),
              HasSubstr("topic /imu0: expected the serialization 'cdr', found 'json'"));
}

TEST_F(Ros2Bag, MessagesThatEndTooSoonAreRefused) {
  const auto imuBag = [&](const std::string& data) {
    std::string path = (folder_ / "cut.db3").string();
    fs::remove(path);
    const BagWriter writer(path);
    writer.topic(1, "/l", "sensor_msgs/msg/Image");
    writer.topic(2, "/r", "sensor_msgs/msg/Image");
    writer.topic(3, "/imu0", "sensor_msgs/msg/Imu");
    writer.put(3, kFirstStamp, data);
    return path;
  };
  const std::string whole = imuOf({kFirstStamp, {1, 2, 3}, {4, 5, 6}}, kLittle);
  for (const size_t size : {size_t{0}, size_t{3}, size_t{10}, size_t{40}, whole.size() - 1})
    EXPECT_THAT(openingError(imuBag(whole.substr(0, size))),
                HasSubstr("expected messages in CDR: "))
        << size;
}

TEST_F(Ros2Bag, AnImageThatClaimsMoreThanItHasIsSkipped) {
  {
    sqlite3* database = nullptr;
    ASSERT_EQ(sqlite3_open((bag_ / "flight_0.db3").c_str(), &database), SQLITE_OK);
    const cv::Mat gray(kHeight, kWidth, CV_8UC1, cv::Scalar(1));
    const std::string data = imageOf(frameStamp(1), gray, 0xffffffff);
    sqlite3_stmt* statement = nullptr;
    sqlite3_prepare_v2(database,
                       "UPDATE messages SET data = ?1 WHERE id = (SELECT id FROM messages WHERE "
                       "topic_id = 1 ORDER BY id LIMIT 1 OFFSET 1)",
                       -1, &statement, nullptr);
    sqlite3_bind_blob(statement, 1, data.data(), static_cast<int>(data.size()), SQLITE_TRANSIENT);
    ASSERT_EQ(sqlite3_step(statement), SQLITE_DONE);
    sqlite3_finalize(statement);
    sqlite3_close(database);
  }
  const auto source = openSource(bag_.string());
  EXPECT_EQ(framesOf(readAll(*source)).size(), static_cast<size_t>(kFrames - 1));
  EXPECT_EQ(source->statistics().unreadable_images, 1);
  EXPECT_THAT(source->statistics().warnings,
              ::testing::Contains(HasSubstr("the message ends before its data do")));
}

}  // namespace
}  // namespace etalon::testing
