// What a ROS 1 bag's own structure says wrongly.

#include "bags/ros1_structure.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <rosbag/bag.h>
#include <std_msgs/Header.h>

#include "etalon/testing/tiny_recording.h"

namespace etalon::testing {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

class Ros1Structure : public ::testing::Test {
 protected:
  /** A bag of three messages. */
  std::string bag(rosbag::compression::CompressionType compression) const {
    std::string path = (folder_ / "three.bag").string();
    rosbag::Bag bag;
    bag.open(path, rosbag::bagmode::Write);
    bag.setCompression(compression);
    for (int i = 1; i <= 3; ++i) bag.write("/topic", ros::Time(i, 0), std_msgs::Header());
    bag.close();
    return path;
  }

  /** The complaint after the bytes `offset` behind the first `after` became 0xff. */
  std::string complaint(
      const std::string& after, size_t offset, size_t bytes = 4,
      rosbag::compression::CompressionType compression = rosbag::compression::Uncompressed) const {
    const std::string path = bag(compression);
    std::string content = readText(path);
    const size_t at = content.find(after);
    EXPECT_NE(at, std::string::npos) << after;
    content.replace(at + after.size() + offset, bytes, std::string(bytes, '\xff'));
    writeText(path, content);
    return dataErrorOf([&] { checkRos1Structure(path); });
  }

  TemporaryFolder folder_;
};

// A header's last field is `ver` or `op` here; four bytes of the data's length follow, then data.
const std::string kIndexHeader = "ver=" + std::string("\x01\0\0\0", 4);

TEST_F(Ros1Structure, WholeBagsAreSound) {
  for (const auto compression :
       {rosbag::compression::Uncompressed, rosbag::compression::LZ4, rosbag::compression::BZ2}) {
    const std::string path = bag(compression);
    EXPECT_EQ(dataErrorOf([&] { checkRos1Structure(path); }), "");
  }
}

TEST_F(Ros1Structure, AnIndexThatLeadsNowhereIsFound) {
  for (const auto compression : {rosbag::compression::Uncompressed, rosbag::compression::LZ4})
    EXPECT_THAT(complaint(kIndexHeader, 4 + 8, 4, compression),
                AllOf(HasSubstr("three.bag: expected a ROS 1 bag: "),
                      HasSubstr("the index names a message that is not there (offset ")));
  EXPECT_THAT(complaint("chunk_pos=", 0, 8),
              HasSubstr("the index names a chunk that is not there (offset 18446744073709551615)"));
  EXPECT_THAT(complaint("index_pos=", 0, 8), HasSubstr("behind the end of the file"));
}

TEST_F(Ros1Structure, WrongLengthsAreFound) {
  EXPECT_THAT(complaint("#ROSBAG V2.0\n", 0), HasSubstr("a record ends too soon (offset "));
  EXPECT_THAT(complaint(kIndexHeader, 0), HasSubstr("a record ends too soon"));
  EXPECT_THAT(complaint("size=", 0), HasSubstr("a chunk of another size"));
  EXPECT_THAT(complaint("#ROSBAG V2.0\n", 4), HasSubstr("a field of a record's header ends too"));
  EXPECT_THAT(complaint("chunk_pos", 0, 1), HasSubstr("header is no field"));
  EXPECT_THAT(complaint("chunk_po", 0, 1), HasSubstr("a record without 'chunk_pos'"));
}

TEST_F(Ros1Structure, ACutFileIsFound) {
  const std::string whole = readText(bag(rosbag::compression::Uncompressed));
  const std::string path = (folder_ / "cut.bag").string();
  for (size_t size = 20; size < whole.size(); size += whole.size() / 7) {
    writeText(path, whole.substr(0, size));
    EXPECT_THAT(dataErrorOf([&] { checkRos1Structure(path); }), HasSubstr("expected a ROS 1 bag"))
        << size;
  }
}

}  // namespace
}  // namespace etalon::testing
