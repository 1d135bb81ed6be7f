#include <gmock/gmock.h>
#include <gtest/gtest.h>
#define XXH_INLINE_ALL  // the checksum alone, without the library
#include <xxhash.h>

#include <filesystem>
#include <fstream>
#include <sstream>

#include "etalon/benchmark/sequence_tracks.h"
#include "etalon/core/errors.h"
#include "etalon/testing/temporary_folder.h"

namespace etalon {
namespace {

using ::testing::HasSubstr;

class TrackCache : public ::testing::Test {
 protected:
  /** Two frames: stereo, left alone, and, if wanted, the right camera alone. */
  static SequenceTracks tracks(bool right_only) {
    SequenceTracks tracks;
    TrackedFrame frame;
    frame.t = 1'403'636'584'763'555'584;
    frame.observations = {{-7, {0.1, 1.0 / 3.0}, {1e-300, 479.5}, true},
                          {1LL << 60, {751.0, -0.0}, {0.0, 0.0}, false}};
    tracks.frames = {frame, TrackedFrame()};
    tracks.frames[1].t = frame.t + 50'000'000;
    if (right_only) tracks.frames[1].right_only = {{5, {12.25, 13.5}}, {6, {0.7, 0.9}}};
    tracks.unreadable_images = 3;
    tracks.frontend_ms = 4.0625;
    return tracks;
  }
  std::string bytes() const {
    std::ostringstream text;
    text << std::ifstream(path_, std::ios::binary).rdbuf();
    return text.str();
  }
  /** Writes the bytes with a checksum that fits them. */
  void rewrite(std::string bytes) const {
    const XXH64_hash_t checksum = XXH3_64bits(bytes.data(), bytes.size() - sizeof checksum);
    bytes.replace(bytes.size() - sizeof checksum, sizeof checksum,
                  reinterpret_cast<const char*>(&checksum), sizeof checksum);
    folder_.write("cached.tracks", bytes);
  }
  /** Why the file is refused, which must change nothing; empty if it is read. */
  std::string whyNot(const std::string& key) const {
    SequenceTracks read;
    read.unreadable_images = -1;
    std::string why_not;
    if (readTracks(path_, key, &read, &why_not)) return "";
    EXPECT_TRUE(read.frames.empty());
    EXPECT_EQ(read.unreadable_images, -1);
    return why_not;
  }

  testing::TemporaryFolder folder_;
  const std::string path_ = folder_ / "cached.tracks";
  const std::string key_ = std::string(32, 'a');
};

TEST_F(TrackCache, GivesBackEveryBitOfEveryFrame) {
  for (const bool right_only : {false, true}) {
    const SequenceTracks written = tracks(right_only);
    writeTracks(path_, key_, written);
    SequenceTracks read;
    std::string why_not;
    ASSERT_TRUE(readTracks(path_, key_, &read, &why_not)) << why_not;
    EXPECT_EQ(read.unreadable_images, 3);
    EXPECT_EQ(read.frontend_ms, 4.0625);
    ASSERT_EQ(read.frames.size(), 2U);
    for (size_t k = 0; k < 2; ++k) {
      const TrackedFrame &a = written.frames[k], &b = read.frames[k];
      EXPECT_EQ(a.t, b.t);
      ASSERT_EQ(a.observations.size(), b.observations.size());
      for (size_t i = 0; i < a.observations.size(); ++i) {
        EXPECT_EQ(a.observations[i].id, b.observations[i].id);
        EXPECT_EQ(a.observations[i].left, b.observations[i].left);
        EXPECT_EQ(a.observations[i].has_right, b.observations[i].has_right);
        EXPECT_EQ(a.observations[i].right, b.observations[i].right);
      }
      // The odometry needs these where the left lens is covered.
      ASSERT_EQ(a.right_only.size(), b.right_only.size());
      for (size_t i = 0; i < a.right_only.size(); ++i) {
        EXPECT_EQ(a.right_only[i].id, b.right_only[i].id);
        EXPECT_EQ(a.right_only[i].right, b.right_only[i].right);
      }
    }
  }
}

TEST_F(TrackCache, StereoTracksAloneAreWrittenAsTheyAlwaysWere) {
  writeTracks(path_, key_, tracks(false));
  EXPECT_EQ(bytes()[8], 1);
  EXPECT_EQ(bytes().size(), 8U + 4 + 32 + 4 + 8 + 8 + 2 * 12 + 41 + 25 + 8);
  writeTracks(path_, key_, tracks(true));
  EXPECT_EQ(bytes()[8], 2);
}

TEST_F(TrackCache, IsReadWithItsOwnKeyAlone) {
  writeTracks(path_, key_, tracks(false));
  EXPECT_EQ(whyNot(key_), "");
  EXPECT_THAT(whyNot(std::string(31, 'a') + "b"), HasSubstr("other data, options or code"));
}

TEST_F(TrackCache, ADamagedFileIsNotRead) {
  EXPECT_THAT(whyNot(key_), HasSubstr("no such file"));
  writeTracks(path_, key_, tracks(true));
  const std::string whole = bytes();
  for (size_t cut = 0; cut < whole.size(); cut += 7) {
    folder_.write("cached.tracks", whole.substr(0, cut));
    EXPECT_NE(whyNot(key_), "") << cut;
  }
  for (size_t at = 44; at < whole.size(); at += 5) {  // behind the key
    std::string flipped = whole;
    flipped[at] = static_cast<char>(flipped[at] ^ 0x10);
    folder_.write("cached.tracks", flipped);
    EXPECT_THAT(whyNot(key_), HasSubstr("checksum")) << at;
  }
}

TEST_F(TrackCache, NumbersThatDoNotFitTheFileAreNotBelieved) {
  writeTracks(path_, key_, tracks(true));
  const std::string whole = bytes();
  std::string changed = whole;
  changed[8] = 3;
  rewrite(changed);
  EXPECT_THAT(whyNot(key_), HasSubstr("another version"));
  changed = whole;
  changed[44 + 4 + 8] = 3;  // frames
  rewrite(changed);
  EXPECT_THAT(whyNot(key_), HasSubstr("length"));
  changed[44 + 4 + 8] = 1;
  rewrite(changed);
  EXPECT_THAT(whyNot(key_), HasSubstr("length"));
  changed = whole;
  changed[44 + 4 + 8 + 8 + 8 + 3] = 0x7f;  // two thousand million landmarks
  rewrite(changed);
  EXPECT_THAT(whyNot(key_), HasSubstr("length"));
  changed = whole;
  changed[0] = 'e';
  rewrite(changed);
  EXPECT_THAT(whyNot(key_), HasSubstr("no file of tracks"));
}

TEST_F(TrackCache, AFolderThatIsNotThereIsAnError) {
  EXPECT_THROW(writeTracks(folder_ / "no/such/folder/x.tracks", key_, {}), DataError);
}

}  // namespace
}  // namespace etalon
