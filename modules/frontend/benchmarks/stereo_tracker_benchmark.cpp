// A stereo frame of EuRoC's size through the front end, one thread, on images of a textured wall.

#include <benchmark/benchmark.h>

#include <opencv2/core.hpp>
#include <vector>

#include "../tests/textured_wall.h"
#include "etalon/core/so3.h"
#include "etalon/frontend/stereo_tracker.h"

namespace etalon {
namespace {

/** smallRig() at 752 x 480. */
StereoInertialCalibration fullRig() {
  StereoInertialCalibration calibration = smallRig();
  for (CameraCalibration& camera : calibration.cameras) {
    const CameraModel& m = camera.model;
    std::vector<double> intrinsics = m.intrinsics();
    for (double& x : intrinsics) x *= 2.0;
    camera.model = CameraModel("pinhole", "radial-tangential", 2 * m.width(), 2 * m.height(),
                               intrinsics, m.coefficients());
  }
  return calibration;
}

void trackFrame(benchmark::State& state) {
  cv::setNumThreads(1);
  const StereoInertialCalibration rig = fullRig();
  const TexturedWall wall(rig, 3.0);
  constexpr int kFrames = 20;
  std::vector<std::pair<cv::Mat, cv::Mat>> images;
  std::vector<SE3> T_WB;
  for (int i = 0; i < kFrames; ++i) {
    T_WB.emplace_back(expSO3(i * Eigen::Vector3d(0.002, -0.004, 0.01)),
                      i * Eigen::Vector3d(0.03, 0.01, 0.01));
    images.push_back(wall.pair(T_WB.back()));
  }
  StereoTrackerOptions options;
  options.max_features = static_cast<int>(state.range(0));
  StereoTracker tracker(rig, options);
  // There and back again, so that no jump lies between two passes.
  int i = 0, step = 1, previous = 0;
  TimeNs t = 0;
  double landmarks = 0;
  for (auto _ : state) {
    const auto& [left, right] = images[i];
    const Eigen::Matrix3d R_prev_cur = T_WB[previous].R.transpose() * T_WB[i].R;
    landmarks += static_cast<double>(
        tracker.track(t += 50'000'000, left, right, R_prev_cur).observations.size());
    previous = i;
    if (i + step < 0 || i + step >= kFrames) step = -step;
    i += step;
  }
  state.counters["landmarks"] = landmarks / static_cast<double>(state.iterations());
}
BENCHMARK(trackFrame)->Arg(150)->Arg(250)->Arg(400)->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace etalon
