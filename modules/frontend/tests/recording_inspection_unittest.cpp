#include "etalon/frontend/recording_inspection.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <functional>
#include <opencv2/imgcodecs.hpp>

#include "etalon/core/errors.h"
#include "etalon/testing/tiny_recording.h"

namespace etalon::testing {
namespace {

using ::testing::Contains;
using ::testing::HasSubstr;

class RecordingInspectionOfFolder : public ::testing::Test {
 protected:
  RecordingInspectionOfFolder() { writeTinyRecording(folder.path()); }

  RecordingInspection inspect(const InspectionOptions& options = {}) const {
    return inspectRecording(*openRecording(folder.path()), options);
  }
  std::vector<std::string> warnings() const { return inspect().info.warnings; }
  std::vector<std::string> errors() const { return inspect().info.errors; }

  TemporaryFolder folder;
};

TEST_F(RecordingInspectionOfFolder, SixImagesGiveNoTimeOffset) {
  const RecordingInspection inspection = inspect();
  EXPECT_FALSE(inspection.time_offset.estimated);
  EXPECT_THAT(inspection.time_offset.reason, HasSubstr("too few images"));
  EXPECT_FALSE(inspection.rotation_disagreement_deg.has_value());
  EXPECT_EQ(inspection.info.images.count, static_cast<size_t>(kFrames));
}

TEST_F(RecordingInspectionOfFolder, ImagesThatOnlyDecodingShowsToBeSpoiltAreNoticed) {
  const auto image = folder / ("mav0/cam0/data/" + std::to_string(frameStamp(0)) + ".png");
  std::string spoilt = readText(image);
  for (size_t i = 60; i < spoilt.size() - 60; ++i) spoilt[i] = 'x';
  writeText(image, spoilt);
  EXPECT_THAT(warnings(), Contains(HasSubstr("1 of 6 pairs cannot be used")));
  InspectionOptions headers_alone;
  headers_alone.max_frames = 0;
  const RecordingInspection unseen = inspect(headers_alone);
  EXPECT_THAT(unseen.info.warnings, ::testing::Not(Contains(HasSubstr("cannot be used"))));
  EXPECT_EQ(unseen.time_offset.reason, "not asked for");
}

/** Replaces every image of a camera by what `change` makes of the pair. */
void changeImages(const TemporaryFolder& folder, int camera,
                  const std::function<cv::Mat(const cv::Mat& left, const cv::Mat& right)>& change) {
  for (int i = 0; i < kFrames; ++i) {
    const std::string name = std::to_string(frameStamp(i)) + ".png";
    const auto path = [&](int c) {
      return (folder / ("mav0/cam" + std::to_string(c)) / "data" / name).string();
    };
    const cv::Mat left = cv::imread(path(0), cv::IMREAD_GRAYSCALE);
    const cv::Mat right = cv::imread(path(1), cv::IMREAD_GRAYSCALE);
    cv::imwrite(path(camera), change(left, right));
  }
}

TEST_F(RecordingInspectionOfFolder, ACoveredLensAndLeftEqualToRightAreNoticed) {
  changeImages(folder, 1, [](const cv::Mat& left, const cv::Mat&) { return left; });
  EXPECT_THAT(errors(), Contains(HasSubstr("left and right image are the same")));
  changeImages(folder, 1, [](const cv::Mat& left, const cv::Mat&) {
    return cv::Mat(left.size(), CV_8UC1, cv::Scalar(2));
  });
  EXPECT_THAT(errors(), Contains(HasSubstr("without contrast")));
}

TEST_F(RecordingInspectionOfFolder, WhatNoResultCanBeRightWithIsRefused) {
  EXPECT_NO_THROW(requireSoundRecording(folder.path()));
  // A flight needs no ground truth.
  writeText(folder / "mav0/state_groundtruth_estimate0/data.csv", "no,ground,truth\n");
  EXPECT_NO_THROW(requireSoundRecording(folder.path()));
  changeImages(folder, 1, [](const cv::Mat& left, const cv::Mat&) { return left; });
  EXPECT_THAT(dataErrorOf([&] { requireSoundRecording(folder.path()); }),
              ::testing::AllOf(HasSubstr(folder.path()), HasSubstr("no result can be right"),
                               HasSubstr("left and right image are the same")));
}

}  // namespace
}  // namespace etalon::testing
