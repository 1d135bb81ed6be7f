// Kalibr's files beside a whole recording: the first byte says which of the two is the input.

#include "etalon/datasets/sensor_source.h"
#include "fuzz_recording.h"
#include "fuzz_targets.h"

namespace {

constexpr const char* kCamchain =
    "cam0:\n  camera_model: pinhole\n  distortion_model: radtan\n"
    "  distortion_coeffs: [-0.28, 0.07, 0.0002, 0.00002]\n  intrinsics: [458.6, 457.3, 367.2, "
    "248.4]\n"
    "  resolution: [752, 480]\n"
    "  T_cam_imu: [[0, 1, 0, 0], [-1, 0, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]\n"
    "cam1:\n  camera_model: pinhole\n  distortion_model: radtan\n"
    "  distortion_coeffs: [-0.28, 0.07, 0.0002, 0.00002]\n  intrinsics: [457.6, 456.1, 379.9, "
    "255.2]\n"
    "  resolution: [752, 480]\n"
    "  T_cn_cnm1: [[1, 0, 0, -0.11], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]\n";
constexpr const char* kImu =
    "accelerometer_noise_density: 0.002\naccelerometer_random_walk: 0.003\n"
    "gyroscope_noise_density: 0.00017\ngyroscope_random_walk: 0.00002\nupdate_rate: 200.0\n"
    "rostopic: /imu0\n";

}  // namespace

void etalon::fuzz::camchain(const std::uint8_t* data, std::size_t size) {
  static const Recording recording;
  Bytes bytes(data, size);
  const bool of_imu = bytes.take<std::uint8_t>() % 2 == 1;
  const std::string input = bytes.rest();
  SourceOptions options;
  options.decode_images = false;
  options.recording.camchain = inFile("camchain.yaml", of_imu ? kCamchain : input);
  options.recording.imu_yaml = inFile("imu.yaml", of_imu ? input : kImu);
  mayRefuse([&] { openSource(recording.path(), options); });
}
