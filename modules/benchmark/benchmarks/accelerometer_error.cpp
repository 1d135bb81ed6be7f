// accelerometer_error SRC...
//
// How far is the accelerometer off in motion, and does the IMU alone show it? SRC is a recording
// (EuRoC folder or .rawlog) with ground truth, velocities and biases included. Its time is divided
// into intervals; those at rest (slower than 0.1 m/s) are left out. Prints, for intervals of three
// lengths, and separately for samples that show less and more than five times the data sheet's
// noise (shownNoiseDensity):
//  - how many there are, and the noise that the samples show, in units of the data sheet's;
//  - by how much the change of velocity that the IMU integrates to is off, against the ground truth
//    (RMS of an axis), in standard deviations of the data sheet's white noise; b_a is the mean of
//    the ground truth's within 10 s.
// The last lines are of all recordings together.
//
// Then how alike neighbouring intervals err: the root of half the mean square of the difference
// between the mean errors of two intervals of the shortest length, an axis of the body, mm/s^2, by
// how far apart they are (what is constant cancels); and the two laws of a slow error that come
// closest to it: a Gauss-Markov process of the first order, and SlowAcceleration.

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <functional>
#include <limits>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "etalon/core/errors.h"
#include "etalon/datasets/recorded_source.h"
#include "etalon/imu/bias_priors.h"
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
/** Half the squared difference of two intervals' errors, (m/s^2)^2, by how many intervals they are
 * apart. */
constexpr size_t kLags = 10;
struct Variogram {
  std::array<double, kLags + 1> sum{};
  std::array<int, kLags + 1> count{};

  void add(const std::vector<std::optional<Eigen::Vector3d>>& errors) {
    for (size_t lag = 1; lag <= kLags; ++lag)
      for (size_t k = lag; k < errors.size(); ++k)
        if (errors[k] && errors[k - lag]) {
          sum[lag] += (*errors[k] - *errors[k - lag]).squaredNorm() / 6.0;
          ++count[lag];
        }
  }
  double at(size_t lag) const { return sum[lag] / std::max(1, count[lag]); }
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

/** Adds an interval. @return its mean error in the body, m/s^2; none where it does not count */
std::optional<Eigen::Vector3d> addInterval(const RecordedSource& recording, const ImuBuffer& imu,
                                           TimeNs t0, double length_s, Sums* sums) {
  const GroundTruth& truth = recording.groundTruth();
  const TimeNs t1 = t0 + durationNs(length_s);
  const auto start = truth.at(t0), middle = truth.at((t0 + t1) / 2), end = truth.at(t1);
  if (!start || !middle || !end || !imu.covers(t0, t1)) return std::nullopt;
  if (middle->v_WB.norm() < kMinSpeed_mps) return std::nullopt;
  const ImuNoiseDensities& sheet = recording.calibration().imu.noise;
  const Preintegration integral(imu.between(t0, t1),
                                {middle->bias.gyro, biasAbout(truth, middle->t)}, sheet);
  const Eigen::Vector3d gravity(0.0, 0.0, -kGravity_mps2);
  const Eigen::Vector3d error =
      end->v_WB - start->v_WB - gravity * length_s - start->T_WB.R * integral.deltas().dv;
  const double variance = sheet.accel_noise_density * sheet.accel_noise_density;
  const double shown = shownNoiseDensity(integral.samples(), &ImuSample::accel);
  Sum& sum = (*sums)[{length_s, shown > kVibrates * sheet.accel_noise_density}];
  ++sum.count;
  sum.shown2 += shown * shown / variance;
  sum.error2 += error.squaredNorm() / 3.0 / (variance * length_s);
  return middle->T_WB.R.transpose() * error / length_s;
}

void print(const std::string& name, const Sums& sums) {
  for (const auto& [key, sum] : sums)
    std::printf("%-28s | %.2f s | %-11s | %4d | %5.1f | %5.2f\n", name.c_str(), key.first,
                key.second ? "vibrates" : "does not", sum.count, std::sqrt(sum.shown2 / sum.count),
                std::sqrt(sum.error2 / sum.count));
}

void print(const std::string& name, const Variogram& variogram) {
  std::printf("%-28s", name.c_str());
  for (size_t lag = 1; lag <= kLags; ++lag)
    std::printf(" | %4.1f", 1e3 * std::sqrt(variogram.at(lag)));
  std::printf("\n");
}

/** The law sigma^2 (1 - correlation(lag)) that is closest to the variogram, all lags alike. */
void printLaw(const char* name, const Variogram& variogram,
              const std::function<double(double lag_s, double time_s)>& correlation) {
  double least = std::numeric_limits<double>::max(), variance = 0.0, time_s = 0.0;
  for (int i = 10; i <= 500; ++i) {
    double xx = 0.0, xy = 0.0, yy = 0.0;
    for (size_t lag = 1; lag <= kLags; ++lag) {
      const double x = 1.0 - correlation(kIntervals_s[0] * lag, 0.01 * i), y = variogram.at(lag);
      xx += x * x;
      xy += x * y;
      yy += y * y;
    }
    if (yy - xy * xy / xx < least) {
      least = yy - xy * xy / xx;
      variance = xy / xx;
      time_s = 0.01 * i;
    }
  }
  Variogram law;
  for (size_t lag = 1; lag <= kLags; ++lag) {
    law.sum[lag] = variance * (1.0 - correlation(kIntervals_s[0] * lag, time_s));
    law.count[lag] = 1;
  }
  char text[80];
  std::snprintf(text, sizeof text, "%s, %.1f, %.2f s", name, 1e3 * std::sqrt(variance), time_s);
  print(text, law);
}

void run(const std::vector<std::string>& sources) {
  Sums all;
  Variogram variogram;
  std::vector<std::pair<std::string, Variogram>> variograms;
  std::printf("recording | interval | platform | count | shown | error\n");
  for (const std::string& source : sources) {
    const auto recording = openRecording(source);
    const GroundTruth& truth = recording->groundTruth();
    if (!truth.has_velocity || !truth.has_biases)
      throw DataError(source, 0, "has no ground truth with velocities and biases");
    const ImuBuffer imu(recording->imuSamples());
    Sums sums;
    const std::string name = source.substr(source.find_last_of('/') + 1);
    variograms.emplace_back(name, Variogram());
    for (const double length_s : kIntervals_s) {
      std::vector<std::optional<Eigen::Vector3d>> errors;
      for (TimeNs t = truth.states.front().t; t < truth.states.back().t; t += durationNs(length_s))
        errors.push_back(addInterval(*recording, imu, t, length_s, &sums));
      if (length_s == kIntervals_s[0]) {
        variograms.back().second.add(errors);
        variogram.add(errors);
      }
    }
    print(name, sums);
    for (const auto& [key, sum] : sums) {
      all[key].count += sum.count;
      all[key].shown2 += sum.shown2;
      all[key].error2 += sum.error2;
    }
  }
  print("all", all);
  std::printf("difference of intervals %.2f s and more apart\n", kIntervals_s[0]);
  for (const auto& [name, one] : variograms) print(name, one);
  print("all", variogram);
  printLaw("Gauss-Markov", variogram,
           [](double lag_s, double time_s) { return std::exp(-lag_s / time_s); });
  printLaw("SlowAcceleration", variogram, [](double lag_s, double time_s) {
    return SlowAcceleration{1.0, time_s}.correlation(lag_s);
  });
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
