// Kalibr's files, written and read.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "calibration/kalibr_camchain.h"
#include "calibration/kalibr_imu.h"
#include "calibration/kalibr_text.h"
#include "etalon/core/so3.h"
#include "etalon/testing/tiny_recording.h"

namespace etalon::testing {
namespace {

using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

class KalibrFiles : public ::testing::Test {
 protected:
  static StereoInertialCalibration rig(const std::string& distortion) {
    StereoInertialCalibration rig;
    rig.cameras[0].model = CameraModel("pinhole", distortion, 640, 480, {400.1, 401.3, 321, 239},
                                       {-0.28, 0.07, 2e-4, 1.7e-5});
    rig.cameras[1].model = rig.cameras[0].model.with("fu", 399.0 + 1.0 / 3.0);
    rig.cameras[0].T_BC = {expSO3({0.1, -2.0, 0.3}), {0.01, 0.02, -0.03}};
    rig.cameras[1].T_BC = {expSO3({0.1, -2.0, 0.31}), {0.12, 0.02, -0.03}};
    return rig;
  }
  std::string path(const std::string& name, const std::string& text) const {
    writeText(folder_ / name, text);
    return (folder_ / name).string();
  }

  TemporaryFolder folder_;
};

TEST_F(KalibrFiles, CamerasComeBack) {
  for (const char* distortion : {"radial-tangential", "equidistant"}) {
    const StereoInertialCalibration written = rig(distortion);
    const KalibrCamchain chain =
        readKalibrCamchain(path("camchain.yaml", camchainText(written, {"/a/raw", "/b/raw"})));
    EXPECT_THAT(chain.warnings, IsEmpty()) << "T_cam_imu and T_cn_cnm1 agree";
    EXPECT_THAT(chain.topics, ElementsAre("/a/raw", "/b/raw"));
    for (size_t c = 0; c < 2; ++c) {
      EXPECT_EQ(chain.models[c], written.cameras[c].model) << distortion;
      // Read rotations are brought to the nearest one.
      EXPECT_LT((chain.T_CI[c].inverse().matrix() - written.cameras[c].T_BC.matrix()).norm(),
                1e-14);
    }
  }
  EXPECT_THAT(camchainText(rig("radial-tangential"), {"", ""}),
              HasSubstr("distortion_model: radtan\n"));
}

TEST_F(KalibrFiles, TheImuComesBack) {
  ImuCalibration imu;
  imu.noise = {1.0 / 3.0e4, 2e-5, 3e-3, 4e-4};
  imu.rate_hz = 400.0;
  const KalibrImu read = readKalibrImu(path("imu.yaml", kalibrImuText(imu, "/imu")));
  EXPECT_EQ(read.noise.gyro_noise_density, imu.noise.gyro_noise_density);
  EXPECT_EQ(read.noise.gyro_random_walk, 2e-5);
  EXPECT_EQ(read.noise.accel_noise_density, 3e-3);
  EXPECT_EQ(read.noise.accel_random_walk, 4e-4);
  EXPECT_EQ(read.rate_hz, 400.0);
  EXPECT_EQ(read.topic, "/imu");
  EXPECT_THAT(read.warnings, IsEmpty());
}

TEST_F(KalibrFiles, AnImuNeedsNoRateAndNoTopic) {
  const std::string text = kalibrImuText(ImuCalibration(), "/imu");
  const KalibrImu imu = readKalibrImu(path("imu.yaml", text.substr(0, text.find("rostopic"))));
  EXPECT_FALSE(imu.rate_hz);
  EXPECT_EQ(imu.topic, "");
}

TEST_F(KalibrFiles, MistakesOfTheImuAreNamed) {
  const std::string text = kalibrImuText(ImuCalibration(), "/imu");
  const auto error = [&](const std::string& from, const std::string& to) {
    std::string spoilt = text;
    spoilt.replace(spoilt.find(from), from.size(), to);
    return dataErrorOf([&] { readKalibrImu(path("imu.yaml", spoilt)); });
  };
  EXPECT_THAT(error("gyroscope_random_walk: ", "gyroscope_random_walk: -"),
              AllOf(HasSubstr("imu.yaml:4: "), HasSubstr("not to be negative")));
  EXPECT_THAT(error("accelerometer_random_walk", "accelerometer_walk"),
              HasSubstr("'accelerometer_random_walk' is missing"));
  EXPECT_THAT(error("rostopic: /imu", "rostopic: [1, 2]"),
              AllOf(HasSubstr("imu.yaml:5: "), HasSubstr("expected 'rostopic' to be a topic")));
  EXPECT_THAT(dataErrorOf([&] { readKalibrImu(path("imu.yaml", "imu0: 3\n")); }),
              HasSubstr("expected 'imu0' to be an IMU of Kalibr's"));
}

TEST_F(KalibrFiles, TheShiftOfTheLeftCameraIsThatOfBoth) {
  KalibrCamchain chain;
  std::vector<std::string> warnings;
  EXPECT_EQ(imageTimeShift(chain, "chain", &warnings), 0.0);
  EXPECT_THAT(warnings, IsEmpty());
  chain.timeshift_s = {0.010, 0.012};
  EXPECT_EQ(imageTimeShift(chain, "chain", &warnings), 0.010);
  EXPECT_THAT(warnings, ElementsAre(HasSubstr("cam0 and cam1 differ by 2.0"),
                                    HasSubstr("are moved by 10 ms")));
}

}  // namespace
}  // namespace etalon::testing
