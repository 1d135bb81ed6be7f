// Cameras other than EuRoC's, in the files that describe them.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <sstream>

#include "etalon/core/output_file.h"
#include "etalon/datasets/convert.h"
#include "etalon/datasets/observation_conversion.h"
#include "etalon/datasets/sensor_source.h"
#include "etalon/datasets/sensor_yaml_text.h"
#include "etalon/testing/tiny_recording.h"

namespace etalon::testing {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

const std::vector<double> kFisheye = {-0.0135, 0.0118, -0.0031, 0.0002};

class CameraFiles : public ::testing::Test {
 protected:
  CameraFiles() { writeTinyRecording(path()); }
  std::string path() const { return (folder_ / "recording").string(); }
  std::string file(const std::string& name) const { return path() + "/mav0/" + name; }
  StereoInertialCalibration read() const { return openSource(path())->calibration(); }
  std::vector<std::string> warnings() const { return openSource(path())->statistics().warnings; }
  void makeFisheye() const {
    for (const char* camera : {"cam0/sensor.yaml", "cam1/sensor.yaml"}) {
      replaceInFile(file(camera), "radial-tangential", "equidistant");
      replaceInFile(file(camera), "[-0.28, 0.07, 2e-4, 1.7e-05]",
                    "[-0.0135, 0.0118, -0.0031, 0.0002]");
    }
  }

  /** One coefficient more for the left camera. */
  void writeWithFifth(const std::string& k3) const {
    replaceInFile(file("cam0/sensor.yaml"), "1.7e-05]", "1.7e-05, " + k3 + "]");
  }

  TemporaryFolder folder_;
};

TEST_F(CameraFiles, TheTextOfACameraReadsBackAsItIs) {
  makeFisheye();
  CameraCalibration camera = read().cameras[1];
  camera.model = camera.model.with("fu", 458.123456789012345);
  camera.T_BC.t.x() += 1.0 / 3.0;
  writeFile(file("cam1/sensor.yaml"), cameraYaml(camera, "corrected"));
  EXPECT_TRUE(read().cameras[1].model == camera.model);
  EXPECT_EQ(read().cameras[1].T_BC.t, camera.T_BC.t);
}

TEST_F(CameraFiles, SensorYamlDescribesAFisheye) {
  makeFisheye();
  const CameraModel model = read().cameras[1].model;
  EXPECT_TRUE(model ==
              CameraModel("pinhole", "equidistant", 64, 48, {45.5, 45.25, 31.5, 23.5}, kFisheye));
  EXPECT_FALSE(model.isPerspective());
}

TEST_F(CameraFiles, DistortionNoneIsAPinholeWithout) {
  replaceInFile(file("cam0/sensor.yaml"), "radial-tangential", "none");
  EXPECT_EQ(read().cameras[0].model.coefficients(), std::vector<double>(4, 0.0));
}

TEST_F(CameraFiles, FiveCoefficientsAreAPinholeWithK3) {
  const CameraModel given = read().cameras[0].model;
  writeWithFifth("-0.04");
  const CameraModel model = read().cameras[0].model;
  EXPECT_EQ(model.parameter("k3"), -0.04);
  EXPECT_EQ(model.parameter("k1"), given.parameter("k1"));
  const auto observation = toObservation(StereoFrame{}, read());
  EXPECT_EQ(observation.leftCamera.distortion, mrpt::img::DistortionModel::plumb_bob);
  EXPECT_TRUE(calibrationOf(observation, SE3(), "test").cameras[0].model == model);
  writeFile(file("cam0/sensor.yaml"), cameraYaml(read().cameras[0], "as \"it\": is # written"));
  EXPECT_TRUE(read().cameras[0].model == model);
}

TEST_F(CameraFiles, AFifthCoefficientOfZeroChangesNothing) {
  const CameraModel given = read().cameras[0].model;
  writeWithFifth("0.0");
  EXPECT_TRUE(read().cameras[0].model == given);
}

TEST_F(CameraFiles, FisheyesSurviveARawlog) {
  makeFisheye();
  const std::string log = (folder_ / "log.rawlog").string();
  SourceOptions whole;
  whole.imu_margin_s = 1e9;
  ConvertOptions options;
  options.embed = true;
  convertToRawlog(*openSource(path(), whole), log, options);
  expectSameRecording(*openSource(path()), *openSource(log));
}

TEST_F(CameraFiles, MrptNamesTheFisheyeKannalaBrandt) {
  makeFisheye();
  const StereoInertialCalibration calibration = read();
  const auto observation = toObservation(StereoFrame{}, calibration);
  EXPECT_EQ(observation.leftCamera.distortion, mrpt::img::DistortionModel::kannala_brandt);
  EXPECT_EQ(observation.leftCamera.k3(), kFisheye[2]);
  const StereoInertialCalibration back = calibrationOf(observation, SE3(), "test");
  for (size_t c = 0; c < 2; ++c) EXPECT_TRUE(back.cameras[c].model == calibration.cameras[c].model);
}

std::string rows(const SE3& T) {
  const Eigen::Matrix4d m = T.matrix();
  std::ostringstream text;
  text.precision(17);
  for (int r = 0; r < 4; ++r)
    text << "  - [" << m(r, 0) << ", " << m(r, 1) << ", " << m(r, 2) << ", " << m(r, 3) << "]\n";
  return text.str();
}

/** As kalibr_calibrate_imu_camera writes it, of the tiny recording's own rig. */
class Camchain : public CameraFiles {
 protected:
  Camchain() : rig_(read()) {
    text_ = camera(0, "");
    text_ += camera(1, "  T_cn_cnm1:\n" + rows(rig_.rightFromLeft()));
    // What sensor.yaml says is not looked at.
    for (const char* camera : {"cam0/sensor.yaml", "cam1/sensor.yaml"})
      writeText(file(camera), "no: camera\n");
  }
  std::string camera(size_t c, const std::string& more) const {
    return "cam" + std::to_string(c) + ":\n  T_cam_imu:\n" + rows(rig_.cameras[c].T_BC.inverse()) +
           more +
           "  cam_overlaps: [1]\n"
           "  camera_model: pinhole\n"
           "  distortion_coeffs: [-0.0135, 0.0118, -0.0031, 0.0002]\n"
           "  distortion_model: equidistant\n"
           "  intrinsics: [45.5, 45.25, 31.5, 23.5]\n"
           "  resolution: [64, 48]\n"
           "  rostopic: /cam/image_raw\n"
           "  timeshift_cam_imu: 0.0\n";
  }
  /** Everywhere. */
  void change(const std::string& from, const std::string& to) {
    ASSERT_NE(text_.find(from), std::string::npos) << from;
    for (size_t at = 0; (at = text_.find(from, at)) != std::string::npos; at += to.size())
      text_.replace(at, from.size(), to);
  }
  void write() const { writeText(file("camchain.yaml"), text_); }
  std::string error() const {
    write();
    return dataErrorOf([this] { read(); });
  }

  StereoInertialCalibration rig_;
  std::string text_;
};

TEST_F(Camchain, IsTheCalibrationOfItsFolder) {
  write();
  const StereoInertialCalibration calibration = read();
  for (size_t c = 0; c < 2; ++c) {
    EXPECT_TRUE(calibration.cameras[c].model ==
                CameraModel("pinhole", "equidistant", 64, 48, {45.5, 45.25, 31.5, 23.5}, kFisheye));
    EXPECT_TRUE(
        calibration.cameras[c].T_BC.matrix().isApprox(rig_.cameras[c].T_BC.matrix(), 1e-14));
    EXPECT_NEAR(calibration.cameras[c].rate_hz, 20.0, 1e-5);  // of the stamps, 7 ns apart
  }
  EXPECT_EQ(calibration.imu.noise.accel_noise_density, 2e-3);  // imu0/sensor.yaml still
  EXPECT_TRUE(warnings().empty());
}

TEST_F(Camchain, TheRightCameraMayStandOnTheLeftOneAlone) {
  const size_t at = text_.find("  T_cam_imu", text_.find("cam1:"));
  text_.erase(at, text_.find("  T_cn_cnm1") - at);
  write();
  EXPECT_TRUE(read().cameras[1].T_BC.matrix().isApprox(rig_.cameras[1].T_BC.matrix(), 1e-14));
}

TEST_F(Camchain, TimeshiftMovesTheImagesToTheClockOfTheImu) {
  change("timeshift_cam_imu: 0.0", "timeshift_cam_imu: -0.0025");
  write();
  const auto source = openSource(path());
  ASSERT_EQ(source->imageStamps().size(), static_cast<size_t>(kFrames));
  for (int i = 0; i < kFrames; ++i) EXPECT_EQ(source->imageStamps()[i], frameStamp(i) - 2'500'000);
  EXPECT_EQ(framesOf(readAll(*source)).front().t, frameStamp(0) - 2'500'000);
  EXPECT_THAT(warnings(),
              ::testing::ElementsAre(AllOf(HasSubstr("camchain.yaml"), HasSubstr("-2.5 ms"))));
}

TEST_F(Camchain, ImagesThatATimeshiftTakesBeforeTheBeginningOfTimeAreLeftOut) {
  for (const char* camera : {"cam0", "cam1"}) {
    std::string rows = "#timestamp [ns],filename\n";
    for (int i = 0; i < kFrames; ++i)
      rows += std::to_string(i * 50'000'000) + "," + std::to_string(frameStamp(i)) + ".png\n";
    writeFile(file(std::string(camera) + "/data.csv"), rows);
  }
  change("timeshift_cam_imu: 0.0", "timeshift_cam_imu: -0.0025");
  write();
  const auto source = openSource(path());
  ASSERT_EQ(source->imageStamps().size(), static_cast<size_t>(kFrames - 1));
  EXPECT_EQ(source->imageStamps()[0], 47'500'000);
  EXPECT_THAT(source->statistics().warnings,
              ::testing::Contains(HasSubstr("1 images are left out: timeshift_cam_imu")));
}

TEST_F(Camchain, PosesThatDisagreeAreTold) {
  rig_.cameras[1].T_BC.t.x() += 0.01;
  text_ = text_.substr(0, text_.find("cam1:")) +
          camera(1, text_.substr(text_.find("  T_cn_cnm1"),
                                 text_.rfind("  cam_overlaps") - text_.find("  T_cn_cnm1")));
  write();
  EXPECT_THAT(warnings(), ::testing::ElementsAre(HasSubstr("do not agree")));
}

TEST_F(Camchain, ErrorsNameFileLineAndKey) {
  const std::string whole = text_;
  change("  camera_model: pinhole", "  camera_model: ds");
  EXPECT_THAT(error(), AllOf(HasSubstr("camchain.yaml:8: "), HasSubstr("'ds' is not supported"),
                             HasSubstr("'equidistant'")));
  text_ = whole;
  change("distortion_coeffs: [-0.0135, ", "distortion_coeffs: [");
  EXPECT_THAT(error(), AllOf(HasSubstr("camchain.yaml:9: "), HasSubstr("distortion_coeffs"),
                             HasSubstr("[k1, k2, k3, k4]"), HasSubstr("found 3 numbers")));
  text_ = whole;
  change("cam0:\n  T_cam_imu:", "cam0:\n  T_ci:");
  EXPECT_THAT(error(), AllOf(HasSubstr("camchain.yaml:2: "), HasSubstr("'cam0.T_cam_imu'"),
                             HasSubstr("kalibr_calibrate_imu_camera")));
  text_ = whole;
  change("timeshift_cam_imu: 0.0", "timeshift_cam_imu: 2500");  // microseconds?
  EXPECT_THAT(error(), HasSubstr("camchain.yaml:14: expected 'timeshift_cam_imu'"));
  text_ = whole.substr(0, whole.find("cam1:"));
  EXPECT_THAT(error(), AllOf(HasSubstr("camchain.yaml: "), HasSubstr("'cam1' is missing")));
}

}  // namespace
}  // namespace etalon::testing
