// Streams of measurements as no sensor delivers them: the pipeline takes everything, and throws nothing.

#include <mrpt/obs/CObservationGPS.h>
#include <mrpt/obs/CObservationIMU.h>

#include <cmath>
#include <limits>
#include <opencv2/imgproc.hpp>

#include "etalon/pipeline/run_configuration.h"
#include "etalon/simulation/euroc_rig.h"
#include "fuzz_input.h"
#include "fuzz_targets.h"

namespace {

using namespace etalon;

constexpr int kMaxMeasurements = 60;
constexpr int kWidth = 188, kHeight = 120;  // a quarter of EuRoC's

StereoInertialCalibration smallRig() {
  StereoInertialCalibration rig = eurocCalibration();
  for (CameraCalibration& camera : rig.cameras)
    camera.model = CameraModel("pinhole", "radial-tangential", kWidth, kHeight,
                               {115.0, 115.0, 0.5 * kWidth, 0.5 * kHeight}, {0.0, 0.0, 0.0, 0.0});
  return rig;
}

/** A number as it should be, or one that should not be. */
double number(fuzz::Bytes* bytes, double scale) {
  const auto kind = bytes->take<std::uint8_t>();
  if (kind == 255) return std::numeric_limits<double>::quiet_NaN();
  if (kind == 254) return std::numeric_limits<double>::infinity();
  if (kind == 253) return bytes->take<double>();
  return scale * (kind - 126) / 126.0;
}

/** Noise that the eye follows, shifted by so many pixels. */
cv::Mat texture(int shift) {
  static const cv::Mat all = [] {
    cv::Mat noise(kHeight, 4 * kWidth, CV_8UC1);
    cv::RNG random(7);
    random.fill(noise, cv::RNG::UNIFORM, 0, 256);
    cv::GaussianBlur(noise, noise, {5, 5}, 0);
    cv::normalize(noise, noise, 0, 255, cv::NORM_MINMAX);
    return noise;
  }();
  return all(cv::Rect(shift, 0, kWidth, kHeight)).clone();
}

StereoFrame frame(TimeNs t, fuzz::Bytes* bytes) {
  StereoFrame f;
  f.t = t;
  const auto kind = bytes->take<std::uint8_t>();
  const int shift = bytes->take<std::uint8_t>();
  f.left = texture(shift);
  f.right = texture(shift + 4);
  if (kind == 0) f.left = cv::Mat();
  if (kind == 1) f.right = cv::Mat(3, 5, CV_8UC1, cv::Scalar(9));
  if (kind == 2) f.left.setTo(0);
  if (kind == 3) f.right.setTo(255);
  return f;
}

ImuSample sample(TimeNs t, fuzz::Bytes* bytes) {
  ImuSample s;
  s.t = t;
  for (int i = 0; i < 3; ++i) s.gyro[i] = number(bytes, 1.0);
  for (int i = 0; i < 3; ++i) s.accel[i] = number(bytes, 5.0) + (i == 2 ? 9.81 : 0.0);
  return s;
}

/** As a driver would deliver it, with or without the fields. */
mrpt::obs::CObservationIMU observation(TimeNs t, fuzz::Bytes* bytes) {
  mrpt::obs::CObservationIMU o;
  o.timestamp = mrpt::Clock::fromDouble(1e-9 * static_cast<double>(t));
  const auto fields = bytes->take<std::uint8_t>();
  if (fields & 1) o.set(mrpt::obs::IMU_X_ACC, number(bytes, 9.0));
  if (fields & 2) o.set(mrpt::obs::IMU_WX, number(bytes, 1.0));
  return o;
}

/** Steps of a sensor's clock: nearly always forwards. */
TimeNs step(fuzz::Bytes* bytes) {
  const auto kind = bytes->take<std::uint8_t>();
  if (kind == 255) return bytes->take<std::int64_t>() % (1LL << 40);
  if (kind == 254) return -50'000'000;
  if (kind == 253) return 3'000'000'000;
  return kind < 200 ? 5'000'000 : 1'000'000 * kind;
}

}  // namespace

void etalon::fuzz::pipeline(const std::uint8_t* data, std::size_t size) {
  static const RunConfiguration run = loadRunConfiguration(IniFile(), {});
  static const StereoInertialCalibration rig = smallRig();
  Bytes bytes(data, size);
  Pipeline pipeline(rig, run.pipeline, run.initializers);
  TimeNs t = 1'000'000'000;
  for (int i = 0; i < kMaxMeasurements && !bytes.empty(); ++i) {
    t += step(&bytes);
    switch (bytes.take<std::uint8_t>() % 8) {
      case 0:
      case 1:
        pipeline.add(frame(t, &bytes));
        break;
      case 2:
        pipeline.process(observation(t, &bytes));
        break;
      case 3:
        pipeline.process(mrpt::obs::CObservationGPS());
        break;
      default:
        pipeline.add(sample(t, &bytes));
    }
  }
  pipeline.finish();
  for (const FrameEstimate& estimate : pipeline.estimates())
    if (!estimate.nav.T_WB.t.allFinite()) std::abort();
}
