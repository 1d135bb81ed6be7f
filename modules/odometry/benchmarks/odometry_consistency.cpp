// odometry_consistency [name=value]...
//
// Is the fixed-lag odometry as good as it says? Simulated flights of 60 s whose noise is as it is
// believed; prints the mean NEES a degree of freedom (1 where the covariance is right) of rotation,
// position, velocity, b_g and b_a, and their RMS errors, by time since the start.
//   flights=10 seed=1 duration=60 pixels=1 imu=1 walk=1 start=1 (factors; 0: without that noise)
//   tracks=120 profile=aggressive, map=1 (0: without), the keys of [fixed_lag], and those of [map] as
//   map.key

#include <cstdio>
#include <exception>
#include <map>
#include <string>

#include "../tests/simulated_views.h"
#include "etalon/core/angles.h"
#include "etalon/core/parameters.h"

namespace {

using namespace etalon;

struct Sums {
  Eigen::Matrix<double, 5, 1> nees = Eigen::Matrix<double, 5, 1>::Zero();
  Eigen::Matrix<double, 5, 1> squares = Eigen::Matrix<double, 5, 1>::Zero();
  double pose = 0.0;  // NEES of rotation and position together, 6
  int count = 0;
};

void addFlight(const SimulatedFlight& flight, const FixedLagOptions& options, const MapOptions& map,
               double sigma_px, std::uint64_t seed, double start, std::map<int, Sums>* bins) {
  FixedLagOdometry odometry(flight.calibration, options, map,
                            std::make_shared<SimulatedViews>(flight, sigma_px));
  for (size_t i = 0; i < flight.frames.size(); ++i) {
    const OdometryOutput out =
        i == 0 ? odometry.start(flight.startAt(0, start * startSigma(), seed), flight.frames[0])
               : odometry.process(flight.frames[i], flight.between(i - 1, i));
    Sums& sums = (*bins)[i / 200];
    const Eigen::Matrix<double, 15, 1> d = out.state.minus(flight.truth[i]);
    sums.nees += neesOf(out, flight.truth[i]);
    sums.pose += d.head<6>().dot(out.covariance.topLeftCorner<6, 6>().llt().solve(d.head<6>())) / 6;
    for (int b = 0; b < 5; ++b) sums.squares[b] += d.segment<3>(3 * b).squaredNorm();
    ++sums.count;
  }
}

void run(int argc, char** argv) {
  double flights = 10, seed = 1, pixels = 1, imu = 1, walk = 1, tracks = 120;
  double duration = 60, start = 1, with_map = 1;
  std::string profile = "aggressive";
  FixedLagOptions options;
  ParameterSet section("fixed_lag");
  options.declare(section);
  MapOptions map;
  ParameterSet map_section("map");
  map.declare(map_section);
  std::map<std::string, double*> own = {
      {"flights", &flights},   {"seed", &seed},   {"pixels", &pixels},
      {"imu", &imu},           {"walk", &walk},   {"tracks", &tracks},
      {"duration", &duration}, {"start", &start}, {"map", &with_map},
  };
  IniFile ini;
  IniFile map_ini;
  for (int i = 1; i < argc; ++i) {
    const std::string argument = argv[i];
    const size_t equals = argument.find('=');
    const auto known = own.find(argument.substr(0, equals));
    if (argument.rfind("profile=", 0) == 0)
      profile = argument.substr(equals + 1);
    else if (known != own.end())
      *known->second = std::stod(argument.substr(equals + 1));
    else if (argument.rfind("map.", 0) == 0)
      map_ini.setFromArgument(argument);
    else
      ini.setFromArgument("fixed_lag." + argument);
  }
  section.read(ini);
  map_section.read(map_ini);
  map.enabled = with_map > 0;
  std::map<int, Sums> bins;
  for (int f = 0; f < flights; ++f) {
    SimulatedFlightOptions simulated;
    simulated.seed = static_cast<std::uint64_t>(seed) + static_cast<std::uint64_t>(f);
    simulated.duration_s = duration;
    simulated.profile = motionProfileFromName(profile);
    simulated.sigma_px *= pixels;
    simulated.imu_noise = imu > 0;
    simulated.bias_walk = walk > 0;
    simulated.tracks = static_cast<int>(tracks);
    const SimulatedFlight flight = simulateFlight(simulated);
    options.imu_noise = flight.imu_noise;
    addFlight(flight, options, map, map.sigma_factor * simulated.sigma_px, 1000 + simulated.seed,
              start, &bins);
  }
  std::printf("from, s | pose | NEES R p v b_g b_a | RMS deg, m, m/s, rad/s, m/s^2\n");
  for (const auto& [bin, sums] : bins) {
    const Eigen::Matrix<double, 5, 1> nees = sums.nees / sums.count;
    const Eigen::Matrix<double, 5, 1> rms = (sums.squares / sums.count).cwiseSqrt();
    std::printf("%7d | %.2f | %.2f %.2f %.2f %.2f %.2f | %.4f %.4f %.4f %.5f %.4f\n", 10 * bin,
                sums.pose / sums.count, nees[0], nees[1], nees[2], nees[3], nees[4],
                degrees(rms[0]), rms[1], rms[2], rms[3], rms[4]);
  }
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
