// The fixed-lag odometry with a calibration that is wrong: found, said and corrected; and with a
// right one: left alone.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <map>

#include "../simulated_flight.h"
#include "etalon/odometry/fixed_lag/fixed_lag_odometry.h"
#include "etalon/testing/wrong_calibration.h"

namespace etalon {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using testing::WrongCalibration;
using Verdict = CalibrationFinding::Verdict;

constexpr double kDuration = 25.0, kFrameRate = 10.0;  // s, Hz

SimulatedFlightOptions shortFlight(std::uint64_t seed) {
  SimulatedFlightOptions options;
  options.duration_s = kDuration;
  options.frame_rate_hz = kFrameRate;
  options.tracks = 70;
  options.sigma_px = 0.2;
  options.seed = seed;
  return options;
}

struct Flown {
  std::vector<OdometryOutput> outputs;
  std::map<std::string, CalibrationFinding> findings;  ///< by quantity
};

Flown fly(const SimulatedFlight& flight, const StereoInertialCalibration& given,
          const SimulatedFlightOptions& simulated, CalibrationMode mode,
          double known_offset_s = 0.0) {
  FixedLagOptions options;
  options.imu_noise = flight.imu_noise;
  options.sigma_px = simulated.sigma_px;
  options.calibration.time_offset = options.calibration.extrinsics = mode;
  options.calibration.intrinsics = mode;
  options.calibration.accel_scale_sigma = options.calibration.gyro_scale_sigma =
      0.0;  // as simulated
  FixedLagOdometry odometry(given, options);
  OdometryStart start = flight.startAt(0, startSigma(), 7);
  start.time_offset_s = known_offset_s;
  Flown flown;
  for (size_t i = 0; i < flight.frames.size(); ++i)
    flown.outputs.push_back(i == 0 ? odometry.start(start, flight.frames[0])
                                   : odometry.process(flight.frames[i], flight.between(i - 1, i)));
  for (const CalibrationFinding& finding : odometry.calibrationFindings())
    flown.findings[finding.quantity] = finding;
  return flown;
}

/** RMS of the velocity's error in the axes of the body, m/s, over the last part of the flight. */
double lateVelocityError(const Flown& flown, const SimulatedFlight& flight) {
  double sum = 0.0;
  const size_t n = flown.outputs.size(), from = n * 3 / 5;
  for (size_t i = from; i < n; ++i) {
    const NavState &state = flown.outputs[i].state, &truth = flight.truth[i];
    sum += (state.T_WB.R.transpose() * state.v_WB - truth.T_WB.R.transpose() * truth.v_WB)
               .squaredNorm();
  }
  return std::sqrt(sum / static_cast<double>(n - from));
}

void expectRecovered(const WrongCalibration& wrong, const std::string& quantity,
                     CalibrationMode mode = CalibrationMode::kAuto) {
  SimulatedFlightOptions options = shortFlight(3);
  options.time_offset_s = 1e-3 * wrong.time_offset;
  const SimulatedFlight flight = simulateFlight(options);
  const Flown flown = fly(flight, wrong.given(flight.calibration), options, mode);
  for (const auto& [name, finding] : flown.findings) {
    const Eigen::VectorXd truth = wrong.deviation(finding);
    for (Eigen::Index i = 0; i < finding.value.size(); ++i) {
      // Within three of its own standard deviations; of what is wrong the odometry uses as much.
      EXPECT_LT(std::abs(finding.value[i] - truth[i]), 3.0 * finding.sigma[i]) << finding.words;
      if (name == quantity) {
        EXPECT_LT(std::abs(finding.used[i] - truth[i]), 3.5 * finding.sigma[i]) << finding.words;
      }
      if (name != quantity && mode == CalibrationMode::kAuto) {
        EXPECT_EQ(finding.used[i], 0.0) << finding.words;
      }
    }
    if (mode == CalibrationMode::kAuto) {
      EXPECT_EQ(finding.verdict == Verdict::kOff, name == quantity) << finding.words;
    }
  }
  // As good as with the right calibration, once it is corrected: a fifth more for the noise of two
  // runs, and it would be worse without.
  const double right =
      lateVelocityError(fly(flight, flight.calibration, options, CalibrationMode::kOff), flight);
  if (wrong.time_offset != 0.0) return;  // the right calibration has no such thing
  EXPECT_LT(lateVelocityError(flown, flight), 1.2 * right + 0.001);
}

TEST(CalibratedFlight, FindsATimeOffset) {
  WrongCalibration wrong;
  wrong.time_offset = 5.0;
  expectRecovered(wrong, "time offset");
}

TEST(CalibratedFlight, ATimeOffsetThatTheStartKnowsIsUsedFromTheFirstImageOnAndFollowed) {
  SimulatedFlightOptions options = shortFlight(3);
  options.duration_s = 10.0;
  options.time_offset_s = -0.015;
  const SimulatedFlight flight = simulateFlight(options);
  // Over the first three seconds, before an offset that is not known is found.
  const auto error = [&](const Flown& flown) {
    double sum = 0.0;
    for (size_t i = 0; i < 30; ++i)
      sum += (flown.outputs[i].state.v_WB - flight.truth[i].v_WB).squaredNorm();
    return std::sqrt(sum / 30.0);
  };
  const Flown known = fly(flight, flight.calibration, options, CalibrationMode::kAuto, -0.0145);
  const Flown not_known = fly(flight, flight.calibration, options, CalibrationMode::kAuto);
  const CalibrationFinding& finding = known.findings.at("time offset");
  EXPECT_LT(std::abs(finding.used[0] + 15.0), 3.5 * finding.sigma[0]) << finding.words;
  for (const OdometryOutput& output : known.outputs) EXPECT_TRUE(output.remarks.empty());
  EXPECT_LT(error(known), 0.05);
  EXPECT_LT(error(known), 0.7 * error(not_known));  // whose images that do not fit are left out
  // Off: it is taken as given.
  const Flown off = fly(flight, flight.calibration, options, CalibrationMode::kOff, -0.0145);
  const Flown given = fly(flight, flight.calibration, options, CalibrationMode::kOff);
  for (size_t i = 0; i < off.outputs.size(); ++i)
    ASSERT_EQ(off.outputs[i].state.T_WB.t, given.outputs[i].state.T_WB.t) << i;
}

TEST(CalibratedFlight, FindsThatTheCamerasAreTurnedInTheBody) {
  WrongCalibration wrong;
  wrong.camera_rotation = 0.3;
  expectRecovered(wrong, "rotation of the cameras in the body");
}

TEST(CalibratedFlight, FindsThatTheCamerasAreTurnedToEachOther) {
  WrongCalibration wrong;
  wrong.stereo_rotation = 0.1;
  expectRecovered(wrong, "rotation between the cameras");
}

TEST(CalibratedFlight, FindsFocalLengths) {
  WrongCalibration wrong;
  wrong.focal = 0.3;
  expectRecovered(wrong, "focal lengths");
}

TEST(CalibratedFlight, FindsARadialDistortion) {
  WrongCalibration wrong;
  wrong.radial = 0.8;
  expectRecovered(wrong, "radial distortion");
}

TEST(CalibratedFlight, TakesTwoThirdsOfAThirdRadialCoefficientAwayInHalfAMinute) {
  WrongCalibration wrong;
  wrong.radial = 1.5;
  wrong.radial_k3 = -1.0;  // pixels are off by 0.06, 0.39 and 0.5 px: not what k1 alone can do
  // The mean of four flights: the noise of one is nearly a third of the coefficient.
  constexpr int kFlights = 4;
  Eigen::VectorXd truth, used;
  for (std::uint64_t seed = 1; seed <= kFlights; ++seed) {
    const SimulatedFlightOptions options = shortFlight(seed);
    const SimulatedFlight flight = simulateFlight(options);
    const Flown flown =
        fly(flight, wrong.given(flight.calibration), options, CalibrationMode::kAuto);
    const CalibrationFinding& finding = flown.findings.at("radial distortion");
    EXPECT_EQ(finding.verdict, Verdict::kOff) << finding.words;
    truth = wrong.deviation(finding);
    if (seed == 1) used = Eigen::VectorXd::Zero(truth.size());
    used += finding.used / kFlights;
  }
  for (Eigen::Index i = 0; i < truth.size(); ++i)
    EXPECT_LT(std::abs(used[i] - truth[i]), std::abs(truth[i]) / 3.0) << i;
}

TEST(CalibratedFlight, FollowsTheBaselineWhereItIsAskedTo) {
  WrongCalibration wrong;
  wrong.baseline = 0.6;  // four standard deviations of half a minute: not enough for auto
  expectRecovered(wrong, "baseline", CalibrationMode::kOn);
}

TEST(CalibratedFlight, ARightCalibrationIsLeftAloneAndItsErrorIsAsItIsSaidToBe) {
  double nees = 0.0;
  int count = 0;
  for (std::uint64_t seed = 1; seed <= 5; ++seed) {
    const SimulatedFlightOptions options = shortFlight(seed);
    const SimulatedFlight flight = simulateFlight(options);
    const Flown held = fly(flight, flight.calibration, options, CalibrationMode::kAuto);
    for (const auto& [name, finding] : held.findings) {
      EXPECT_NE(finding.verdict, Verdict::kOff) << finding.words;
      EXPECT_TRUE(finding.used.isZero(0.0)) << finding.words;
      // A focal length is off by the square of the pixels' noise (docs/odometry.md).
      if (name == "focal lengths") continue;
      nees += finding.value.cwiseQuotient(finding.formal_sigma).squaredNorm();
      count += static_cast<int>(finding.value.size());
    }
    if (seed > 1) continue;
    // And so are the states: the equations are the same, but for rounding.
    const Flown off = fly(flight, flight.calibration, options, CalibrationMode::kOff);
    EXPECT_TRUE(off.findings.empty());
    for (size_t i = 0; i < off.outputs.size(); ++i)
      EXPECT_LT((held.outputs[i].state.T_WB.t - off.outputs[i].state.T_WB.t).norm(), 1e-4) << i;
  }
  // 105 numbers, those of a flight correlated; their mean square is known to a quarter.
  EXPECT_GT(nees / count, 0.6);
  EXPECT_LT(nees / count, 1.5);
}

TEST(CalibratedFlight, RepeatsItselfToTheBit) {
  SimulatedFlightOptions options = shortFlight(3);
  options.duration_s = 12.0;
  const SimulatedFlight flight = simulateFlight(options);
  WrongCalibration wrong;
  wrong.camera_rotation = 0.3;
  const auto given = wrong.given(flight.calibration);
  const Flown one = fly(flight, given, options, CalibrationMode::kAuto);
  const Flown two = fly(flight, given, options, CalibrationMode::kAuto);
  std::vector<std::string> remarks;
  for (size_t i = 0; i < one.outputs.size(); ++i) {
    ASSERT_EQ(one.outputs[i].state.T_WB.matrix(), two.outputs[i].state.T_WB.matrix()) << i;
    remarks.insert(remarks.end(), one.outputs[i].remarks.begin(), one.outputs[i].remarks.end());
  }
  EXPECT_THAT(remarks, ElementsAre(HasSubstr("rotation of the cameras in the body")));
}

TEST(CalibratedFlight, StandingStillTellsNothingOfWhatNeedsMotion) {
  SimulatedFlightOptions options = shortFlight(1);
  options.profile = MotionProfile::kStatic;
  const SimulatedFlight flight = simulateFlight(options);
  WrongCalibration wrong;
  wrong.camera_rotation = 0.3;
  const Flown flown = fly(flight, wrong.given(flight.calibration), options, CalibrationMode::kAuto);
  for (const char* quantity : {"time offset", "rotation of the cameras in the body",
                               "position of the cameras in the body", "baseline"}) {
    const CalibrationFinding& finding = flown.findings.at(quantity);
    EXPECT_EQ(finding.verdict, Verdict::kNotObserved) << finding.words;
    EXPECT_TRUE(finding.used.isZero(0.0)) << finding.words;
    // It stays where it was, and says how little is known.
    EXPECT_LT((finding.value.cwiseQuotient(finding.sigma)).norm(), 1.0) << finding.words;
    EXPECT_NE(finding.words.find("not observed"), std::string::npos) << finding.words;
  }
}

}  // namespace
}  // namespace etalon
