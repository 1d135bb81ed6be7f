// A folder as TUM-VI has it: no sensor.yaml, Kalibr's files in dso/, ground truth in mocap0, PNG of 16
// bits.

#include <gmock/gmock.h>

#include <opencv2/imgcodecs.hpp>

#include "euroc_source_test.h"

namespace etalon::testing {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

// The form of TUM-VI's own files; the numbers are of the tiny recording.
constexpr const char* kCamchain = R"(cam0:
  T_cam_imu:
  - [-0.99953071, 0.00744168, -0.02971511, 0.04536566]
  - [0.0294408, -0.03459565, -0.99896766, -0.071996]
  - [-0.00846201, -0.99937369, 0.03436032, -0.04478181]
  - [0.0, 0.0, 0.0, 1.0]
  cam_overlaps: [1]
  camera_model: pinhole
  distortion_coeffs: [0.0034, 0.0007, -0.0020, 0.0002]
  distortion_model: equidistant
  intrinsics: [19.1, 19.2, 31.5, 23.5]
  resolution: [64, 48]
  rostopic: /cam0/image_raw
cam1:
  T_cam_imu:
  - [-0.99951105, 0.00810408, -0.03019914, -0.05545634]
  - [0.03029912, 0.01251164, -0.99946257, -0.06925002]
  - [-0.00772169, -0.99988889, -0.01275107, -0.04745286]
  - [0.0, 0.0, 0.0, 1.0]
  T_cn_cnm1:
  - [0.99999446, 0.00078126, 0.00323532, -0.10106111]
  - [-0.00063326, 0.99889863, -0.04691463, -0.00186024]
  - [-0.00326841, 0.04691231, 0.99889367, -0.00483022]
  - [0.0, 0.0, 0.0, 1.0]
  camera_model: pinhole
  distortion_coeffs: [0.0033, 0.0007, -0.0021, 0.0002]
  distortion_model: equidistant
  intrinsics: [19.0, 19.1, 31.5, 23.5]
  resolution: [64, 48]
  rostopic: /cam1/image_raw
)";

constexpr const char* kImuConfig = R"(#Accelerometers
accelerometer_noise_density: 0.0028     #Noise density (continuous-time)
accelerometer_random_walk:   0.00086    #Bias random walk

#Gyroscopes
gyroscope_noise_density:     0.00016    #Noise density (continuous-time)
gyroscope_random_walk:       0.000022   #Bias random walk

rostopic:                    /imu0      #the IMU ROS topic
update_rate:                 200.0      #Hz (for discretization of the values above)
)";

class TumVi : public EurocSource {
 protected:
  TumVi() {
    for (const char* sensor : {"cam0", "cam1", "imu0"}) fs::remove(mav0(sensor) / "sensor.yaml");
    fs::rename(mav0("state_groundtruth_estimate0"), mav0("mocap0"));
    fs::remove(mav0("mocap0/sensor.yaml"));
    writeText(mav0("mocap0/data.csv"),
              "#timestamp [ns], p_RS_R_x [m], p_RS_R_y [m], p_RS_R_z [m], q_RS_w [], q_RS_x [], "
              "q_RS_y [], q_RS_z []\n" +
                  std::to_string(frameStamp(0)) + ",1,2,3,1,0,0,0\n");
    fs::create_directories(folder / "dso");
    writeText(folder / "dso/camchain.yaml", kCamchain);
    writeText(folder / "dso/imu_config.yaml", kImuConfig);
  }
};

TEST_F(TumVi, IsReadWithKalibrsFilesBesideIt) {
  cv::Mat wide(kHeight, kWidth, CV_16UC1);
  for (int i = 0; i < kHeight * kWidth; ++i)
    wide.at<std::uint16_t>(i / kWidth, i % kWidth) = static_cast<std::uint16_t>(21 * i);
  ASSERT_TRUE(cv::imwrite(leftImage(0).string(), wide));
  const auto source = open();
  const StereoInertialCalibration& calibration = source->calibration();
  EXPECT_FALSE(calibration.cameras[0].model.isPerspective());
  EXPECT_EQ(calibration.cameras[1].model.parameter("fu"), 19.0);
  EXPECT_NEAR(calibration.baseline(), 0.1011, 1e-3);
  EXPECT_EQ(calibration.imu.noise.accel_noise_density, 0.0028);
  EXPECT_EQ(calibration.imu.noise.gyro_random_walk, 0.000022);
  EXPECT_EQ(calibration.imu.rate_hz, 200.0);
  EXPECT_NEAR(calibration.cameras[0].rate_hz, 20.0, 0.01);
  ASSERT_EQ(source->groundTruth().states.size(), 1u);
  EXPECT_FALSE(source->groundTruth().has_velocity);
  EXPECT_EQ(source->groundTruth().states[0].T_WB.t, Eigen::Vector3d(1, 2, 3));
  EXPECT_THAT(source->calibrationFile("imu0"), HasSubstr("dso/imu_config.yaml"));
  EXPECT_THAT(source->calibrationFile("cam1"), HasSubstr("dso/camchain.yaml"));

  const cv::Mat left = source->loadFrame(0).frame.left;
  ASSERT_EQ(left.type(), CV_8UC1);
  for (int i = 0; i < kHeight * kWidth; i += 97) {  // of 16 bits the upper eight, rounded or not
    const double upper = wide.at<std::uint16_t>(i / kWidth, i % kWidth) / 256.0;
    EXPECT_NEAR(left.at<std::uint8_t>(i / kWidth, i % kWidth), upper, 1.0);
  }
}

TEST_F(TumVi, CalibrationsOfTheOptionsComeFirst) {
  writeText(folder / "mine.yaml", kCamchain);
  replaceInFile(folder / "mine.yaml", "[19.1, 19.2", "[20.1, 20.2");
  writeText(folder / "imu.yaml", kImuConfig);
  replaceInFile(folder / "imu.yaml", "0.0028 ", "0.0099 ");
  SourceOptions options;
  options.recording.camchain = (folder / "mine.yaml").string();
  options.recording.imu_yaml = (folder / "imu.yaml").string();
  const auto source = open(options);
  EXPECT_EQ(source->calibration().cameras[0].model.parameter("fu"), 20.1);
  EXPECT_EQ(source->calibration().imu.noise.accel_noise_density, 0.0099);
}

TEST_F(TumVi, KalibrsImuAfterACalibrationLiesBelowImu0) {
  writeText(folder / "dso/imu_config.yaml",
            "imu0:\n  T_i_b:\n  - [1.0, 0.0, 0.0, 0.0]\n  accelerometer_noise_density: 0.003\n"
            "  accelerometer_random_walk: 0.001\n  gyroscope_noise_density: 0.0002\n"
            "  gyroscope_random_walk: 2.0e-05\n  model: scale-misalignment\n  rostopic: /imu0\n"
            "  update_rate: 200.0\n");
  const auto source = open();
  EXPECT_EQ(source->calibration().imu.noise.gyro_random_walk, 2e-5);
  EXPECT_THAT(source->statistics().warnings,
              ::testing::Contains(HasSubstr("the model 'scale-misalignment' of the IMU")));
}

TEST_F(TumVi, MistakesNameFileAndKey) {
  replaceInFile(folder / "dso/imu_config.yaml", "gyroscope_noise_density", "gyroscope_noise");
  EXPECT_THAT(openingError(), AllOf(HasSubstr("dso/imu_config.yaml"),
                                    HasSubstr("'gyroscope_noise_density' is missing")));
  writeText(folder / "dso/imu_config.yaml", kImuConfig);
  replaceInFile(folder / "dso/imu_config.yaml", "200.0 ", "-200.0 ");
  EXPECT_THAT(openingError(), AllOf(HasSubstr("dso/imu_config.yaml:10: "),
                                    HasSubstr("expected 'update_rate' to be positive")));
}

TEST_F(TumVi, AFolderHasNoTopics) {
  SourceOptions options;
  options.recording.imu_topic = "/imu0";
  EXPECT_THROW(open(options), ConfigError);
}

}  // namespace
}  // namespace etalon::testing
