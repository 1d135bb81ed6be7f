#include "image_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <opencv2/imgcodecs.hpp>

#include "etalon/testing/tiny_recording.h"

namespace etalon::testing {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

class ImageFile : public ::testing::Test {
 protected:
  ImageFile() {
    for (CameraCalibration& c : calibration.cameras)
      c.model = CameraModel("pinhole", "radial-tangential", kWidth, kHeight, {45, 45, 32, 24},
                            {0, 0, 0, 0});
    for (int y = 0; y < kHeight; ++y)
      for (int x = 0; x < kWidth; ++x)
        gray.at<std::uint8_t>(y, x) = static_cast<std::uint8_t>(3 * x + y);
    cv::imwrite(path("gray.png"), gray);
  }
  std::string path(const std::string& name) const { return (folder / name).string(); }
  const CameraModel& camera() const { return calibration.cameras[0].model; }

  /** What decoding and what the header say of the same file; they must agree. */
  std::string problemOf(const std::string& name) const {
    std::string problem;
    const cv::Mat image = readGrayImage(path(name), &problem);
    EXPECT_EQ(image.empty(), !problem.empty());
    if (problem.empty()) problem = checkImage(image, camera());
    EXPECT_EQ(checkImageFile(path(name), camera()), problem) << name;
    return problem;
  }

  TemporaryFolder folder;
  StereoInertialCalibration calibration;
  cv::Mat gray = cv::Mat(kHeight, kWidth, CV_8UC1);
};

TEST_F(ImageFile, ReadsWhatWasWritten) {
  std::string problem = "from before";
  EXPECT_EQ(cv::norm(readGrayImage(path("gray.png"), &problem), gray, cv::NORM_INF), 0);
  EXPECT_EQ(problem, "");
  EXPECT_EQ(problemOf("gray.png"), "");
}

TEST_F(ImageFile, ColourAndSixteenBitsBecomeEightBitGray) {
  cv::Mat colour(kHeight, kWidth, CV_8UC3, cv::Scalar(30, 30, 30));
  cv::imwrite(path("colour.png"), colour);
  cv::imwrite(path("deep.png"), cv::Mat(kHeight, kWidth, CV_16UC1, cv::Scalar(0x1234)));
  std::string problem;
  EXPECT_EQ(readGrayImage(path("colour.png"), &problem).at<std::uint8_t>(5, 5), 30);
  EXPECT_EQ(readGrayImage(path("deep.png"), &problem).type(), CV_8UC1);
  EXPECT_EQ(problemOf("colour.png"), "");
}

TEST_F(ImageFile, SaysWhatIsWrongAlikeWithAndWithoutDecoding) {
  EXPECT_THAT(problemOf("none.png"), HasSubstr("no such image"));
  folder.write("empty.png", "");
  EXPECT_THAT(problemOf("empty.png"), HasSubstr("empty"));
  folder.write("text.png", "this is no image, although it is long enough for a header");
  EXPECT_THAT(problemOf("text.png"), HasSubstr("expected a PNG"));
  const std::string whole = readText(path("gray.png"));
  for (const size_t bytes : {9UL, 20UL, whole.size() / 2, whole.size() - 9}) {
    folder.write("cut.png", whole.substr(0, bytes));
    EXPECT_THAT(problemOf("cut.png"), HasSubstr("truncated")) << bytes;
  }
  cv::imwrite(path("small.png"), gray.rowRange(0, kHeight - 1));
  EXPECT_THAT(problemOf("small.png"), AllOf(HasSubstr("64x48"), HasSubstr("found 64x47")));
}

TEST_F(ImageFile, OtherFormatsAreReadAsWell) {
  cv::imwrite(path("gray.pgm"), gray);
  std::string problem;
  EXPECT_EQ(cv::norm(readGrayImage(path("gray.pgm"), &problem), gray, cv::NORM_INF), 0);
  EXPECT_EQ(checkImageFile(path("gray.pgm"), camera()), "");
}

TEST_F(ImageFile, APairNamesTheFirstFileThatIsWrong) {
  const LoadedFrame good = loadPair(7, path("gray.png"), path("gray.png"), calibration, true);
  EXPECT_EQ(good.problem, "");
  EXPECT_EQ(good.frame.t, 7);
  EXPECT_FALSE(good.frame.left.empty() || good.frame.right.empty());
  const LoadedFrame right = loadPair(7, path("gray.png"), path("none.png"), calibration, true);
  EXPECT_EQ(right.file, path("none.png"));
  const LoadedFrame both = loadPair(7, path("left.png"), path("right.png"), calibration, true);
  EXPECT_EQ(both.file, path("left.png"));
  const LoadedFrame paths = loadPair(7, path("left.png"), path("right.png"), calibration, false);
  EXPECT_EQ(paths.problem, "");
  EXPECT_EQ(paths.frame.right_path, path("right.png"));
  EXPECT_TRUE(paths.frame.left.empty());
}

}  // namespace
}  // namespace etalon::testing
