#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>

#include "etalon/benchmark/sequence_tracks.h"
#include "etalon/testing/temporary_folder.h"

namespace etalon {
namespace {

TEST(TrackCache, IsReadWithItsOwnKeyAlone) {
  const testing::TemporaryFolder folder;
  const std::string path = folder / "cached.tracks";
  const std::string key(32, 'a'), other = std::string(31, 'a') + "b";
  SequenceTracks tracks;
  TrackedFrame frame;
  frame.t = 17;
  tracks.frames = {frame};
  tracks.unreadable_images = 3;
  writeTracks(path, key, tracks);

  SequenceTracks read;
  std::string why_not;
  EXPECT_FALSE(readTracks(path, other, &read, &why_not));
  EXPECT_THAT(why_not, ::testing::HasSubstr("other data, options or code"));
  EXPECT_TRUE(read.frames.empty());
  ASSERT_TRUE(readTracks(path, key, &read, &why_not)) << why_not;
  ASSERT_EQ(read.frames.size(), 1U);
  EXPECT_EQ(read.frames[0].t, 17);
  EXPECT_EQ(read.unreadable_images, 3);
}

}  // namespace
}  // namespace etalon
