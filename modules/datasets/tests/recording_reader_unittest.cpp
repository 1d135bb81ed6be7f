// RecordedSource on a reader that has no files, and what the readers say of theirs.

#include "etalon/datasets/recording_reader.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <set>

#include "etalon/core/errors.h"
#include "etalon/datasets/convert.h"
#include "etalon/datasets/euroc_files.h"
#include "etalon/datasets/recorded_source.h"
#include "etalon/testing/tiny_recording.h"

namespace etalon::testing {
namespace {

using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
namespace fs = std::filesystem;

/** Images every 50 ms, IMU every 5 ms; nothing behind it. */
class FakeReader : public RecordingReader {
 public:
  Recording read() override {
    Recording recording;
    for (int i = 0; i < pairs; ++i) recording.image_stamps.push_back(50'000'000LL * i);
    for (int i = 0; i < samples; ++i)
      recording.imu.push_back({5'000'000LL * (i - 20), {0, 0, 0.1}, {0, 0, 9.81}});
    recording.unpaired_left = {25'000'000, 425'000'000};
    recording.warnings = {"one warning"};
    return recording;
  }
  LoadedFrame load(size_t index, bool decode) override {
    EXPECT_GE(index, last) << "indices must not decrease";
    last = index;
    LoadedFrame loaded;
    loaded.frame.t = 50'000'000LL * static_cast<TimeNs>(index);
    decoded += decode;
    if (broken.count(index)) loaded.file = "fake", loaded.problem = "is broken";
    return loaded;
  }
  std::pair<std::string, std::string> paths(size_t) const override { return {}; }
  std::vector<RecordingFile> files() const override { return {{"/a/fake", "fake"}}; }
  std::string calibrationFile(const std::string& sensor) const override { return "fake." + sensor; }

  int pairs = 10, samples = 150;
  std::set<size_t> broken;
  size_t last = 0;
  int decoded = 0;
};

RecordedSource sourceOf(std::unique_ptr<FakeReader> reader, const SourceOptions& options = {}) {
  return {"a flight", "fake", std::move(reader), options};
}

TEST(RecordedSourceOf, AReaderKnowsItsNameKindAndFiles) {
  const RecordedSource source = sourceOf(std::make_unique<FakeReader>());
  EXPECT_EQ(source.name(), "a flight");
  EXPECT_EQ(source.kind(), "fake");
  EXPECT_EQ(source.calibrationFile("imu0"), "fake.imu0");
  ASSERT_EQ(source.files().size(), 1u);
  EXPECT_EQ(source.files()[0].name, "fake");
  EXPECT_THAT(source.statistics().warnings, ElementsAre("one warning"));
}

TEST(RecordedSourceOf, AnyRangeIsInOrderAndInsideTheImusTime) {
  for (int from = 0; from < 9; ++from)
    for (int to = from; to < 10; ++to) {
      SourceOptions options;
      options.from_s = 0.05 * from;
      options.to_s = 0.05 * to + 1e-6;
      RecordedSource source = sourceOf(std::make_unique<FakeReader>(), options);
      TimeNs before = -1'000'000'000, last_image = -1, last_imu = -1;
      int images = 0;
      while (const auto event = source.next()) {
        ASSERT_GE(stampOf(*event), before);
        before = stampOf(*event);
        if (std::holds_alternative<ImuSample>(*event)) {
          last_imu = before;
          continue;
        }
        // At equal stamps the IMU's sample comes first, so it is there already.
        EXPECT_GE(last_imu, before) << "image " << images << " of " << from << " to " << to;
        last_image = before;
        ++images;
      }
      EXPECT_EQ(images, to - from + 1);
      EXPECT_EQ(last_image, 50'000'000LL * to);
      EXPECT_EQ(source.statistics().unpaired_left,
                from == 0 && to > 0 ? (to > 8 ? 2 : 1) : (to > 8 && from < 9));
    }
}

TEST(RecordedSourceOf, BrokenPairsAreSkippedAndCounted) {
  auto reader = std::make_unique<FakeReader>();
  reader->broken = {0, 4, 9};
  RecordedSource source = sourceOf(std::move(reader));
  EXPECT_EQ(framesOf(readAll(source)).size(), 7u);
  EXPECT_EQ(source.statistics().unreadable_images, 3);
  EXPECT_THAT(source.statistics().warnings.back(), AllOf(HasSubstr("fake"), HasSubstr("broken")));
  auto all = std::make_unique<FakeReader>();
  all->broken = {0, 1, 2, 3, 4, 5, 6, 7, 8, 9};
  RecordedSource refused = sourceOf(std::move(all));
  EXPECT_THAT(dataErrorOf([&] { readAll(refused); }),
              HasSubstr("is broken (of 10 stereo pairs none can be read)"));
}

TEST(RecordedSourceOf, NothingToReadIsAnError) {
  auto no_pairs = std::make_unique<FakeReader>();
  no_pairs->pairs = 0;
  EXPECT_THAT(dataErrorOf([&] { sourceOf(std::move(no_pairs)); }),
              AllOf(HasSubstr("a flight"), HasSubstr("no stereo pair")));
  auto no_imu = std::make_unique<FakeReader>();
  no_imu->samples = 0;
  EXPECT_THAT(dataErrorOf([&] { sourceOf(std::move(no_imu)); }), HasSubstr("expected IMU samples"));
}

std::vector<std::string> namesOf(const std::vector<RecordingFile>& files) {
  std::vector<std::string> names;
  for (const RecordingFile& file : files) names.push_back(file.name);
  return names;
}

TEST(RecordingFiles, OfAEurocFolderAreNamedByTheirPlaceInItWhereverItLies) {
  const TemporaryFolder folder;
  writeTinyRecording(folder / "here");
  const auto files = openRecording((folder / "here").string())->files();
  EXPECT_EQ(files.size(), 2u * (kFrames + 2) + 2 + 1);
  EXPECT_TRUE(std::is_sorted(files.begin(), files.end(),
                             [](const auto& a, const auto& b) { return a.name < b.name; }));
  for (const RecordingFile& file : files) EXPECT_TRUE(fs::is_regular_file(file.path)) << file.path;
  fs::rename(folder / "here", folder / "there");
  EXPECT_EQ(namesOf(openRecording((folder / "there").string())->files()), namesOf(files));
  EXPECT_EQ(namesOf(openRecording((folder / "there/mav0").string())->files()), namesOf(files));
}

TEST(RecordingFiles, OfARawlogAreTheLogAndTheImagesThatAreThere) {
  const TemporaryFolder folder;
  writeTinyRecording(folder / "recording");
  const std::string log = (folder / "log.rawlog").string();
  SourceOptions paths;
  paths.decode_images = false;
  convertToRawlog(*openSource((folder / "recording").string(), paths), log);
  const auto source = openRecording(log);
  EXPECT_EQ(source->calibrationFile("cam1"), log);
  EXPECT_EQ(source->files().size(), 1u + 2 * kFrames);
  EXPECT_EQ(source->files()[0].path, log);
  for (const std::string& name : namesOf(source->files())) EXPECT_EQ(name, "");
  fs::remove(source->framePaths(2).first);
  EXPECT_EQ(source->files().size(), 2u * kFrames);
}

TEST(EurocFiles, ImuSamplesArePutInOrderAndKeptThoughTheyAreNoMeasurements) {
  const TemporaryFolder folder;
  std::vector<std::string> warnings;
  const std::string row = ",0,0,0,0,0,9.8\n";
  const std::vector<ImuSample> samples = readImuCsv(
      folder.write("file.csv", "1" + row + "3,0,nan,0,0,0,inf\n2" + row + "2" + row), &warnings);
  ASSERT_EQ(samples.size(), 3u);
  for (size_t i = 0; i < 3; ++i) EXPECT_EQ(samples[i].t, static_cast<TimeNs>(i + 1));
  EXPECT_FALSE(samples[2].gyro.allFinite() || samples[2].accel.allFinite());
  EXPECT_THAT(warnings, ::testing::ElementsAre(
                            HasSubstr("file.csv: samples were not in the order of their stamps"),
                            HasSubstr("file.csv: 1 samples with the stamp of another one")));
}

TEST(EurocFiles, SayFileLineAndWhatWasExpected) {
  const TemporaryFolder folder;
  const auto file = [&](const std::string& text) { return folder.write("file.csv", text); };
  const auto stamps = [&](const std::string& text) {
    return dataErrorOf([&] { readStamps(file(text)); });
  };
  EXPECT_EQ(readStamps(file("\xEF\xBB\xBF# stamps\r\n\r\n 5 \r\n7\n")),
            (std::vector<TimeNs>{5, 7}));
  EXPECT_THAT(stamps("1\n2,3\n"), AllOf(HasSubstr("file.csv:2: "), HasSubstr("1 column")));
  EXPECT_THAT(stamps("1\n1\n"), AllOf(HasSubstr("file.csv:2: "), HasSubstr("duplicate")));
  EXPECT_THAT(stamps("# none\n"), HasSubstr("at least one stamp"));
  EXPECT_THAT(dataErrorOf([&] { readImuCsv(file("1,0,0,0,0,0,9.8\n")); }),
              HasSubstr("at least two IMU samples"));
  EXPECT_THAT(dataErrorOf([&] { readImuCsv(file("1,0,0,0,0,0,9.8\n2,0,0,0,0,0,g\n")); }),
              AllOf(HasSubstr("file.csv:2: "), HasSubstr("column 7"), HasSubstr("'g'")));
  const std::string row = ",0,0,0,1,0,0,0\n";
  EXPECT_EQ(readGroundTruthCsv(file("1" + row + "2" + row), 2).states.size(), 2u);
  EXPECT_THAT(dataErrorOf([&] { readGroundTruthCsv(file("1" + row), 2); }),
              AllOf(HasSubstr("at least 2 states"), HasSubstr("found 1")));
  EXPECT_THAT(dataErrorOf([&] { readGroundTruthCsv(file("1" + row + "2,0,0,0,0,0,0,0\n")); }),
              AllOf(HasSubstr("file.csv:2: "), HasSubstr("unit quaternion")));
  // The first row decides; nothing may change on the way.
  EXPECT_THAT(dataErrorOf([&] {
                readGroundTruthCsv(file("1" + row + "2,0,0,0,1,0,0,0,0,0,0,0,0,0,0,0,0\n"));
              }),
              AllOf(HasSubstr("file.csv:2: "), HasSubstr("found 17")));
}

}  // namespace
}  // namespace etalon::testing
