// Which images measureCameraRotation() looks at, on a reader without files.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <memory>
#include <utility>
#include <vector>

#include "etalon/frontend/time_offset.h"

namespace etalon {
namespace {

/** Black images; remembers which were asked for. */
class BlackImages : public RecordingReader {
 public:
  BlackImages(Recording recording, std::vector<size_t>* loaded)
      : recording_(std::move(recording)), loaded_(*loaded) {}
  Recording read() override { return recording_; }
  LoadedFrame load(size_t index, bool) override {
    loaded_.push_back(index);
    LoadedFrame loaded;
    loaded.frame.left = loaded.frame.right = cv::Mat(48, 64, CV_8UC1, cv::Scalar(0));
    return loaded;
  }
  std::pair<std::string, std::string> paths(size_t) const override { return {}; }
  std::vector<RecordingFile> files() const override { return {}; }
  std::string calibrationFile(const std::string&) const override { return ""; }

 private:
  Recording recording_;
  std::vector<size_t>& loaded_;
};

TEST(CameraRotation, IsMeasuredWhereTheGyroTurnsAndNotWhereASampleIsNone) {
  // 80 images at 20 Hz; the second half turns to and fro, the first is at rest.
  Recording recording;
  for (CameraCalibration& camera : recording.calibration.cameras)
    camera.model = CameraModel("pinhole", "none", 64, 48, {45.0, 45.0, 32.0, 24.0}, {});
  for (int i = 0; i < 80; ++i) recording.image_stamps.push_back(50'000'000LL * i);
  for (int i = 0; i < 800; ++i) {
    ImuSample sample{5'000'000LL * i, Eigen::Vector3d::Zero(), {0.0, 0.0, 9.81}};
    if (i >= 400) sample.gyro.x() = std::sin(0.03 * i);
    recording.imu.push_back(sample);
  }
  for (const double wrong : {5000.0, std::nan("")}) {
    recording.imu[100].gyro.y() = wrong;
    std::vector<size_t> loaded;
    RecordedSource source("flight", "fixed", std::make_unique<BlackImages>(recording, &loaded), {});
    measureCameraRotation(source, 40);
    ASSERT_EQ(loaded.size(), 40U);
    EXPECT_EQ(loaded.front(), 40U) << wrong;
  }
}

}  // namespace
}  // namespace etalon
