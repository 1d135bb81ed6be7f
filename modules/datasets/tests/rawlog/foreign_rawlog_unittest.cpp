#include <gmock/gmock.h>
#include <mrpt/io/CFileGZOutputStream.h>
#include <mrpt/obs/CSensoryFrame.h>
#include <mrpt/serialization/CArchive.h>

#include <functional>
#include <limits>

#include "etalon/core/errors.h"
#include "etalon/datasets/mrpt_time.h"
#include "etalon/datasets/observation_conversion.h"
#include "etalon/datasets/rawlog_writer.h"
#include "etalon/datasets/recording_comment.h"
#include "rawlog/rawlog_test.h"

namespace etalon::testing {
namespace {

using ::testing::AllOf;
using ::testing::Contains;
using ::testing::HasSubstr;

/** Logs of other origin, written object by object. */
class ForeignRawlog : public Rawlog {
 protected:
  ForeignRawlog() {
    const auto source = openWhole(euroc.string());
    calibration = source->calibration();
    events = readAll(*source);
  }

  using Edit = std::function<void(mrpt::obs::CObservationStereoImages&)>;

  /** Without the project's comments. */
  void write(const Edit& edit = {}) {
    RawlogWriter writer(log);
    for (const SensorEvent& event : events) {
      if (const auto* sample = std::get_if<ImuSample>(&event)) {
        writer.write(toObservation(*sample));
        continue;
      }
      auto stereo = toObservation(std::get<StereoFrame>(event), calibration);
      if (edit) edit(stereo);
      writer.write(stereo);
    }
    writer.close();
  }

  StereoInertialCalibration calibration;
  std::vector<SensorEvent> events;
};

TEST_F(ForeignRawlog, TakesCalibrationFromTheObservations) {
  write();
  const auto source = openSource(log);
  const StereoInertialCalibration& read = source->calibration();
  for (size_t c = 0; c < 2; ++c) {
    EXPECT_TRUE(read.cameras[c].model == calibration.cameras[c].model);
    // Through quaternions and a product of transforms.
    EXPECT_TRUE(
        read.cameras[c].T_BC.matrix().isApprox(calibration.cameras[c].T_BC.matrix(), 1e-12));
    EXPECT_NEAR(read.cameras[c].rate_hz, 20, 1e-3);
  }
  EXPECT_NEAR(read.imu.rate_hz, 200, 0.1);  // stamps cut down to 100 ns
  EXPECT_THAT(source->statistics().warnings, Contains(HasSubstr("noise model")));
  const auto frames = framesOf(readAll(*source));
  ASSERT_EQ(frames.size(), static_cast<size_t>(kFrames));
  for (int i = 0; i < kFrames; ++i) EXPECT_EQ(frames[i].t, truncateToMrptTick(frameStamp(i)));
}

TEST_F(ForeignRawlog, SaysWhatIsMissingInTheCalibration) {
  write([](auto& stereo) { stereo.rightCamera.intrinsicParams.setZero(); });
  EXPECT_THAT(dataErrorOf([&] { openSource(log); }),
              AllOf(HasSubstr("right camera"), HasSubstr("intrinsic")));
  write([](auto& stereo) { stereo.rightCameraPose = mrpt::poses::CPose3DQuat(); });
  EXPECT_THAT(dataErrorOf([&] { openSource(log); }), HasSubstr("baseline"));
  write([](auto& stereo) { stereo.leftCamera.k4(0.1); });
  EXPECT_THAT(dataErrorOf([&] { openSource(log); }),
              AllOf(HasSubstr("left camera"), HasSubstr("plumb_bob"), HasSubstr("kannala_brandt")));
  write([](auto& stereo) { stereo.hasImageRight = false; });
  EXPECT_THAT(dataErrorOf([&] { openSource(log); }), HasSubstr("left and a right image"));
}

TEST_F(ForeignRawlog, SensorsThatLackWhatIsNeededAreNotTaken) {
  write();
  const std::string usable = readText(log), all = (folder / "all.rawlog").string();
  RawlogWriter writer(all);
  mrpt::obs::CObservationIMU ahrs;  // orientation alone
  ahrs.sensorLabel = "ahrs";
  ahrs.timestamp = toMrptTime(kFirstStamp);
  ahrs.set(mrpt::obs::IMU_YAW, 0.1);
  writer.write(ahrs);
  mrpt::obs::CObservationStereoImages depth;
  depth.sensorLabel = "depth";
  depth.timestamp = toMrptTime(kFirstStamp);
  writer.write(depth);
  writer.close();
  const std::string unusable = readText(all);
  writeText(all, unusable + usable);
  const auto source = openWhole(all);
  EXPECT_EQ(framesOf(readAll(*source)).size(), static_cast<size_t>(kFrames));
  EXPECT_THAT(
      source->statistics().warnings,
      AllOf(Contains(HasSubstr("the sensor 'ahrs' is ignored; used are 'stereo' and 'imu0'")),
            Contains(HasSubstr("the sensor 'depth' is ignored"))));
  writeText(all, unusable);
  EXPECT_THAT(dataErrorOf([&] { openSource(all); }),
              HasSubstr("a right image, found none; there are others, of 'depth'"));
}

TEST_F(ForeignRawlog, ImagesThatAreNotInOrderAreAnError) {
  std::vector<SensorEvent> swapped = events;
  std::vector<SensorEvent*> frames;
  for (SensorEvent& event : swapped)
    if (std::holds_alternative<StereoFrame>(event)) frames.push_back(&event);
  std::swap(*frames[0], *frames[1]);
  events.swap(swapped);
  write();
  EXPECT_THAT(dataErrorOf([&] { openSource(log); }),
              AllOf(HasSubstr("stereo images"), HasSubstr("strictly increasing")));
}

TEST_F(ForeignRawlog, ImuSamplesArePutInOrderAndKeptThoughTheyAreNoMeasurements) {
  ImuSample no_measurement = std::get<ImuSample>(events[1]);
  no_measurement.gyro.x() = std::numeric_limits<double>::quiet_NaN();
  const SensorEvent first = events[0];
  events[0] = no_measurement;
  events[1] = first;
  events.insert(events.begin() + 2, first);
  write();
  const auto source = openRecording(log);
  EXPECT_EQ(source->imuSamples()[0].t, truncateToMrptTick(stampOf(first)));
  EXPECT_TRUE(std::isnan(source->imuSamples()[1].gyro.x()));
  EXPECT_EQ(source->imuMeasurements().size() + 1, source->imuSamples().size());
  EXPECT_THAT(source->statistics().warnings,
              AllOf(Contains(HasSubstr("samples were not in the order of their stamps")),
                    Contains(HasSubstr("1 samples with the stamp of another one"))));
}

TEST_F(ForeignRawlog, StampsOutsideTheClockAreAnError) {
  using Duration = mrpt::Clock::duration;
  for (const Duration end : {Duration::min(), Duration::max()}) {
    write([end](auto& stereo) { stereo.timestamp = mrpt::Clock::time_point(end); });
    EXPECT_THAT(dataErrorOf([&] { openSource(log); }),
                AllOf(HasSubstr("stereo images"), HasSubstr("1970 to 2096")));
  }
}

TEST_F(ForeignRawlog, NumbersThatAreNoneAreAnError) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  write([nan](auto& stereo) { stereo.leftCamera.cx(nan); });
  EXPECT_THAT(dataErrorOf([&] { openSource(log); }),
              AllOf(HasSubstr("left camera"), HasSubstr("finite numbers")));
  write([nan](auto& stereo) { stereo.rightCameraPose.x(nan); });
  EXPECT_THAT(dataErrorOf([&] { openSource(log); }), HasSubstr("finite numbers of cam1"));
  write([](auto& stereo) { stereo.rightCamera.nrows = 0; });
  EXPECT_THAT(dataErrorOf([&] { openSource(log); }),
              AllOf(HasSubstr("right camera"), HasSubstr("at least 1 x 1 px")));
  convert(log, true);
  const std::string whole = readText(log), more = (folder / "more.rawlog").string();
  RawlogWriter writer(more);
  auto pose = toObservation(StampedPose{kFirstStamp - 1000, SE3()}, kGroundTruthLabel);
  pose.pose.mean.x(nan);
  writer.write(pose);
  writer.close();
  writeText(log, readText(more) + whole);
  EXPECT_THAT(dataErrorOf([&] { openSource(log); }), HasSubstr("finite pose"));
  SourceOptions options;
  options.recording.own_truth = false;
  EXPECT_TRUE(openSource(log, options)->groundTruth().empty());
}

TEST_F(ForeignRawlog, ReadsSensoryFramesInACompressedLog) {
  {
    mrpt::io::CFileGZOutputStream out(log);
    auto archive = mrpt::serialization::archiveFrom(out);
    mrpt::obs::CSensoryFrame frame;
    for (const SensorEvent& event : events) {
      if (const auto* sample = std::get_if<ImuSample>(&event)) {
        frame.push_back(std::make_shared<mrpt::obs::CObservationIMU>(toObservation(*sample)));
      } else {
        frame.push_back(std::make_shared<mrpt::obs::CObservationStereoImages>(
            toObservation(std::get<StereoFrame>(event), calibration)));
        archive << frame;
        frame.clear();
      }
    }
  }
  const auto source = openSource(log);
  EXPECT_EQ(framesOf(readAll(*source)).size(), static_cast<size_t>(kFrames));
}

TEST_F(ForeignRawlog, ImagesAreWhereMrptsToolsPutThem) {
  for (const char* name : {"log_Images", "Images"}) {
    const fs::path images = folder / name;
    fs::create_directory(images);
    int files = 0;
    write([&](auto& stereo) {
      for (mrpt::img::CImage* image : {&stereo.imageLeft, &stereo.imageRight}) {
        const std::string file = std::to_string(files++) + ".png";
        image->saveToFile((images / file).string());
        image->setExternalStorage(file);
      }
    });
    const auto frames = framesOf(readAll(*openSource(log)));
    ASSERT_EQ(frames.size(), static_cast<size_t>(kFrames)) << name;
    EXPECT_EQ(fs::path(frames[0].right_path).parent_path(), images);
    EXPECT_FALSE(frames[0].right.empty());
    fs::remove_all(images);
  }
}

TEST_F(ForeignRawlog, IgnoresFurtherObservations) {
  convert(log, true);
  const std::string base = readText(log);
  const std::string more = (folder / "more.rawlog").string();
  RawlogWriter writer(more);
  writer.write(commentObservation(kFirstStamp, "a comment by hand"));
  writer.write(commentObservation(kFirstStamp, "{\"format\": \"something else\"}"));
  ImuSample other{kFirstStamp, Eigen::Vector3d::Ones(), Eigen::Vector3d::Ones()};
  auto imu = toObservation(other);
  imu.sensorLabel = "imu1";
  writer.write(imu);
  writer.write(toObservation(StampedPose{kFirstStamp, SE3()}, "eta.vi_ba"));
  writer.close();
  writeText(more, base + readText(more));
  expectSameRecording(*openWhole(log), *openWhole(more));
  EXPECT_TRUE(openSource(more)->statistics().warnings.empty());
}

TEST_F(ForeignRawlog, ACommentOfAnotherVersionIsAnError) {
  RawlogWriter writer(log);
  writer.write(commentObservation(kFirstStamp, R"({"format": "etalon recording", "version": 99})"));
  writer.close();
  EXPECT_THAT(dataErrorOf([&] { openSource(log); }),
              AllOf(HasSubstr("expected version 1"), HasSubstr("found 99")));
}

}  // namespace
}  // namespace etalon::testing
