// odometry_consistency [name=value]...
//
// Is the fixed-lag odometry as good as it says? Simulated flights of 60 s whose noise is as it is
// believed; prints the mean NEES a degree of freedom (1 where the covariance is right) of rotation,
// position, velocity, b_g and b_a, and their RMS errors, by time since the start.
//   flights=10 seed=1 duration=60 pixels=1 imu=1 walk=1 start=1 (factors; 0: without that noise)
//   tracks=120 profile=aggressive, or speed=0 turn=0 (m/s, rad/s; with a speed: constant, a line or a
//   circle), map=1 (0: without), the keys of [fixed_lag], and those of [map] as map.key
//   believed=1: factor on the noise of the IMU that the odometry is told
//   stereo=0 (1: beside the drift from 5 s on that of stereo odometry on the same tracks)
//   time_offset=0 (ms) camera_rotation=0 stereo_rotation=0 (deg, about every axis) baseline=0
//   focal=0 (%): how wrong the calibration is that the odometry is given; calibrate=off (on, auto)

#include <cstdio>
#include <exception>
#include <map>
#include <string>

#include "../tests/simulated_views.h"
#include "../tests/steady_flight.h"
#include "etalon/core/angles.h"
#include "etalon/core/parameters.h"
#include "etalon/core/symmetric.h"
#include "etalon/testing/wrong_calibration.h"

namespace {

using namespace etalon;
using testing::WrongCalibration;

struct Sums {
  Eigen::Matrix<double, 5, 1> nees = Eigen::Matrix<double, 5, 1>::Zero();
  Eigen::Matrix<double, 5, 1> squares = Eigen::Matrix<double, 5, 1>::Zero();
  double pose = 0.0;  // NEES of rotation and position together, 6
  int count = 0;
};

/** Over the flights, of one quantity. */
struct Deviations {
  std::string unit;
  double nees = 0.0, widened = 0.0;
  int count = 0;
  std::map<std::string, int> verdicts;
  Eigen::VectorXd truth, values, used;
};

void addFindings(const std::vector<CalibrationFinding>& findings, const WrongCalibration& wrong,
                 std::map<std::string, Deviations>* sums) {
  for (const CalibrationFinding& finding : findings) {
    Deviations& sum = (*sums)[finding.quantity];
    sum.unit = finding.unit;
    sum.truth = wrong.deviation(finding);
    ++sum.verdicts[toString(finding.verdict)];
    if (sum.count == 0) sum.values = sum.used = Eigen::VectorXd::Zero(finding.value.size());
    sum.values += finding.value;
    sum.used += finding.used;
    const Eigen::ArrayXd error = (finding.value - sum.truth).array();
    sum.nees += (error / finding.formal_sigma.array()).square().sum();
    sum.widened += (error / finding.sigma.array()).square().sum();
    sum.count += static_cast<int>(error.size());
  }
}

/** What becomes of the flights. */
struct Results {
  std::map<int, Sums> bins;  // of ten seconds
  std::map<std::string, Deviations> deviations;
  std::map<std::string, DriftRms> drifts;
};

/** Trajectory and keyframes. */
struct Flown {
  Trajectory trajectory;
  std::vector<bool> keyframes;
};

Flown addFlight(const SimulatedFlight& flight, const FixedLagOptions& options,
                const MapOptions& map, double sigma_px, std::uint64_t seed, double start,
                const WrongCalibration& wrong, Results* results) {
  FixedLagOdometry odometry(wrong.given(flight.calibration), options, map,
                            std::make_shared<SimulatedViews>(flight, sigma_px));
  Flown flown;
  for (size_t i = 0; i < flight.frames.size(); ++i) {
    const OdometryOutput out =
        i == 0 ? odometry.start(flight.startAt(0, start * startSigma(), seed), flight.frames[0])
               : odometry.process(flight.frames[i], flight.between(i - 1, i));
    flown.trajectory.push_back({out.t, out.state.T_WB});
    flown.keyframes.push_back(out.keyframe);
    Sums& sums = results->bins[i / 200];
    const Eigen::Matrix<double, 15, 1> d = out.state.minus(flight.truth[i]);
    sums.nees += neesOf(out, flight.truth[i]);
    sums.pose += squaredMahalanobis(d.head<6>(), out.covariance.topLeftCorner<6, 6>()) / 6;
    for (int b = 0; b < 5; ++b) sums.squares[b] += d.segment<3>(3 * b).squaredNorm();
    ++sums.count;
  }
  addFindings(odometry.calibrationFindings(), wrong, &results->deviations);
  return flown;
}

/** @param stereo whether stereo odometry flies, too */
void addDrifts(const SimulatedFlight& flight, const Flown& flown, bool stereo, double sigma_px,
               std::map<std::string, DriftRms>* drifts) {
  constexpr size_t kFirst = 100;  // 5 s
  if (flight.frames.size() < 2 * kFirst) return;
  std::vector<bool> every_fifth;
  for (size_t i = 0; i < flight.frames.size(); ++i) every_fifth.push_back(i % 5 == 0);
  const auto add = [&](const char* name, const Trajectory& trajectory) {
    (*drifts)[name].add(driftOf(trajectory, flight, kFirst));
  };
  add("fixed-lag", flown.trajectory);
  if (!stereo) return;
  add("stereo, the same keyframes", flyStereoAlone(flight, sigma_px, flown.keyframes));
  add("stereo, every fifth frame", flyStereoAlone(flight, sigma_px, every_fifth));
}

struct Arguments {
  double flights = 10, seed = 1, pixels = 1, imu = 1, walk = 1, tracks = 120;
  double duration = 60, start = 1, with_map = 1, speed = 0, turn = 0, believed = 1, stereo = 0;
  std::string profile = "aggressive";
  WrongCalibration wrong;
  FixedLagOptions options;
  MapOptions map;

  Arguments(int argc, char** argv);
};

Arguments::Arguments(int argc, char** argv) {
  std::map<std::string, double*> own = {
      {"flights", &flights}, {"seed", &seed},     {"pixels", &pixels},     {"imu", &imu},
      {"walk", &walk},       {"tracks", &tracks}, {"duration", &duration}, {"start", &start},
      {"map", &with_map},    {"speed", &speed},   {"turn", &turn},         {"believed", &believed},
      {"stereo", &stereo},
  };
  own.merge(wrong.numbers());
  std::string calibrate = "off";
  IniFile ini, map_ini, calibration_ini;
  for (int i = 1; i < argc; ++i) {
    const std::string argument = argv[i];
    const size_t equals = argument.find('=');
    const auto known = own.find(argument.substr(0, equals));
    if (argument.rfind("profile=", 0) == 0)
      profile = argument.substr(equals + 1);
    else if (argument.rfind("calibrate=", 0) == 0)
      calibrate = argument.substr(equals + 1);
    else if (known != own.end())
      *known->second = std::stod(argument.substr(equals + 1));
    else if (argument.rfind("map.", 0) == 0)
      map_ini.setFromArgument(argument);
    else
      ini.setFromArgument("fixed_lag." + argument);
  }
  for (const char* what : {"time_offset", "extrinsics", "intrinsics"})
    calibration_ini.setFromArgument("odometry.calibrate_" + std::string(what) + "=" + calibrate);
  for (const char* sensor : {"accel", "gyro"})  // as simulated
    calibration_ini.setFromArgument("odometry." + std::string(sensor) + "_scale_sigma=0");
  const auto read = [](const char* section, auto& parameters, const IniFile& from) {
    ParameterSet set(section);
    parameters.declare(set);
    set.read(from);
  };
  read("fixed_lag", options, ini);
  read("odometry", options.calibration, calibration_ini);
  read("map", map, map_ini);
  map.enabled = with_map > 0;
}

void print(const std::map<int, Sums>& bins) {
  std::printf("from, s | pose | NEES R p v b_g b_a | RMS deg, m, m/s, rad/s, m/s^2\n");
  for (const auto& [bin, sums] : bins) {
    const Eigen::Matrix<double, 5, 1> nees = sums.nees / sums.count;
    const Eigen::Matrix<double, 5, 1> rms = (sums.squares / sums.count).cwiseSqrt();
    std::printf("%7d | %.2f | %.2f %.2f %.2f %.2f %.2f | %.4f %.4f %.4f %.5f %.4f\n", 10 * bin,
                sums.pose / sums.count, nees[0], nees[1], nees[2], nees[3], nees[4],
                degrees(rms[0]), rms[1], rms[2], rms[3], rms[4]);
  }
}

void print(const std::map<std::string, Deviations>& deviations, double flights) {
  for (const auto& [quantity, sum] : deviations) {
    std::printf("%s (%s): NEES %.2f, with the widened sigma %.2f; mean of true - given",
                quantity.c_str(), sum.unit.c_str(), sum.nees / sum.count, sum.widened / sum.count);
    for (const double truth : sum.truth) std::printf(" %+.4g", truth);
    std::printf(", found");
    for (const double value : sum.values) std::printf(" %+.4g", value / flights);
    std::printf(", used");
    for (const double used : sum.used) std::printf(" %+.4g", used / flights);
    for (const auto& [verdict, count] : sum.verdicts)
      std::printf(", %s %d", verdict.c_str(), count);
    std::printf("\n");
  }
}

void print(const std::map<std::string, DriftRms>& drifts) {
  for (const auto& [name, rms] : drifts) {
    const Drift drift = rms.get();
    std::printf("%s: scale %.3f %%, ATE %.4f m, rotation %.3f deg\n", name.c_str(),
                100.0 * drift.scale, drift.ate, degrees(drift.rotation));
  }
}

void run(int argc, char** argv) {
  Arguments a(argc, argv);
  Results results;
  for (int f = 0; f < a.flights; ++f) {
    SimulatedFlightOptions simulated;
    simulated.seed = static_cast<std::uint64_t>(a.seed) + static_cast<std::uint64_t>(f);
    simulated.duration_s = a.duration;
    simulated.profile = motionProfileFromName(a.profile);
    simulated.sigma_px *= a.pixels;
    simulated.imu_noise = a.imu > 0;
    simulated.bias_walk = a.walk > 0;
    simulated.time_offset_s = 1e-3 * a.wrong.time_offset;
    simulated.tracks = static_cast<int>(a.tracks);
    const SimulatedFlight flight =
        a.speed > 0
            ? simulateFlight(simulated, SteadyTrajectory(a.speed, a.turn, kUnderWay + a.duration))
            : simulateFlight(simulated);
    a.options.imu_noise = flight.imu_noise;
    a.options.imu_noise.gyro_noise_density *= a.believed;
    a.options.imu_noise.accel_noise_density *= a.believed;
    const Flown flown = addFlight(flight, a.options, a.map, a.map.sigma_factor * simulated.sigma_px,
                                  1000 + simulated.seed, a.start, a.wrong, &results);
    addDrifts(flight, flown, a.stereo > 0, simulated.sigma_px, &results.drifts);
  }
  print(results.bins);
  print(results.deviations, a.flights);
  print(results.drifts);
}

}  // namespace

int main(int argc, char** argv) {
  try {
    run(argc, argv);
  } catch (const std::exception& e) {
    std::fprintf(stderr, "odometry_consistency: %s\n", e.what());
    return 3;
  }
  return 0;
}
