// accelerometer_error SRC...
//
// How far is the accelerometer off in motion, and does the IMU alone show it? SRC is a recording
// (EuRoC folder or .rawlog) with ground truth, velocities and biases included. Its time is divided
// into intervals; those at rest (slower than 0.1 m/s) are left out. Prints, for intervals of three
// lengths, and separately for samples that show less and more than five times the data sheet's
// noise (shownAccelNoiseDensity):
//  - how many there are, and the noise that the samples show, in units of the data sheet's;
//  - by how much the change of velocity that the IMU integrates to is off, against the ground truth
//    (RMS of an axis), in standard deviations of the data sheet's white noise; b_a is the mean of
//    the ground truth's within 10 s.
// The last lines are of all recordings together.

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "etalon/core/errors.h"
#include "etalon/datasets/recorded_source.h"
#include "etalon/imu/imu_buffer.h"
#include "etalon/imu/imu_noise.h"
#include "etalon/imu/preintegration.h"

namespace {

using namespace etalon;

constexpr double kIntervals_s[] = {0.25, 0.75, 2.25};
constexpr double kMinSpeed_mps = 0.1;
constexpr double kVibrates = 5.0;  // data sheets
constexpr double kBiasWithin_s = 10.0;
constexpr double kGravity_mps2 = 9.81;

struct Sum {
  int count = 0;
  double shown2 = 0.0, error2 = 0.0;  ///< data sheet's variances
};
using Sums = std::map<std::pair<double, bool>, Sum>;  ///< by length and vibration

Eigen::Vector3d biasAbout(const GroundTruth& truth, TimeNs t) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  int count = 0;
  for (const StampedState& state : truth.states)
    if (std::abs(secondsBetween(t, state.t)) <= kBiasWithin_s) {
      sum += state.bias.accel;
      ++count;
    }
  return sum / std::max(1, count);
}

void addInterval(const RecordedSource& recording, const ImuBuffer& imu, TimeNs t0, double length_s,
                 Sums* sums) {
  const GroundTruth& truth = recording.groundTruth();
  const TimeNs t1 = t0 + durationNs(length_s);
  const auto start = truth.at(t0), middle = truth.at((t0 + t1) / 2), end = truth.at(t1);
  if (!start || !middle || !end || !imu.covers(t0, t1)) return;
  if (middle->v_WB.norm() < kMinSpeed_mps) return;
  const ImuNoiseDensities& sheet = recording.calibration().imu.noise;
  const Preintegration integral(imu.between(t0, t1),
                                {middle->bias.gyro, biasAbout(truth, middle->t)}, sheet);
  const Eigen::Vector3d gravity(0.0, 0.0, -kGravity_mps2);
  const Eigen::Vector3d error =
      end->v_WB - start->v_WB - gravity * length_s - start->T_WB.R * integral.deltas().dv;
  const double variance = sheet.accel_noise_density * sheet.accel_noise_density;
  const double shown = shownAccelNoiseDensity(integral.samples());
  Sum& sum = (*sums)[{length_s, shown > kVibrates * sheet.accel_noise_density}];
  ++sum.count;
  sum.shown2 += shown * shown / variance;
  sum.error2 += error.squaredNorm() / 3.0 / (variance * length_s);
}

void print(const std::string& name, const Sums& sums) {
  for (const auto& [key, sum] : sums)
    std::printf("%-28s | %.2f s | %-11s | %4d | %5.1f | %5.2f\n", name.c_str(), key.first,
                key.second ? "vibrates" : "does not", sum.count, std::sqrt(sum.shown2 / sum.count),
                std::sqrt(sum.error2 / sum.count));
}

void run(const std::vector<std::string>& sources) {
  Sums all;
  std::printf("recording | interval | platform | count | shown | error\n");
  for (const std::string& source : sources) {
    const auto recording = openRecording(source);
    const GroundTruth& truth = recording->groundTruth();
    if (!truth.has_velocity || !truth.has_biases)
      throw DataError(source, 0, "has no ground truth with velocities and biases");
    const ImuBuffer imu(recording->imuSamples());
    Sums sums;
    for (const double length_s : kIntervals_s)
      for (TimeNs t = truth.states.front().t; t < truth.states.back().t; t += durationNs(length_s))
        addInterval(*recording, imu, t, length_s, &sums);
    print(source.substr(source.find_last_of('/') + 1), sums);
    for (const auto& [key, sum] : sums) {
      all[key].count += sum.count;
      all[key].shown2 += sum.shown2;
      all[key].error2 += sum.error2;
    }
  }
  print("all", all);
}

}  // namespace

int main(int argc, char** argv) {
  try {
    if (argc < 2) throw ConfigError("takes recordings");
    run(std::vector<std::string>(argv + 1, argv + argc));
  } catch (const std::exception& e) {
    std::fprintf(stderr, "accelerometer_error: %s\n", e.what());
    return 3;
  }
  return 0;
}
