// What the odometry makes of what its prior says of the calibration.

#include "calibration/calibration_watch.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "etalon/simulation/euroc_rig.h"

namespace etalon::fixed_lag {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using Verdict = CalibrationFinding::Verdict;

/** A window whose prior has measured columns of the calibration. */
struct Measured {
  Window window = windowAt(eurocCalibration(), {0.0, 0.0, -9.81}, {}, 0, Matrix15d::Identity());
  OdometryOutput output;  ///< of an odometry that has settled

  Measured() {
    addCalibrationColumns(eurocCalibration(), &window);
    output.t = 1'000'000'000;
    output.covariance = 1e-6 * Matrix15d::Identity();
  }
  /** One more measurement. */
  void measure(Eigen::Index column, double value, double sigma) {
    LinearRows& prior = window.prior;
    prior.A.conservativeResize(prior.rows() + 1, Eigen::NoChange);
    prior.A.bottomRows<1>().setZero();
    prior.A(prior.A.rows() - 1, column) = 1.0 / sigma;
    prior.b.conservativeResize(prior.A.rows());
    prior.b[prior.b.size() - 1] = -value / sigma;
  }
  /** A second state whose inertial term has nine rows of that mean square. */
  void contradict(double mean_square) {
    std::vector<ImuSample> at_rest;
    for (int i = 0; i <= 20; ++i)
      at_rest.push_back({5'000'000 * i, Eigen::Vector3d::Zero(), Eigen::Vector3d(0, 0, 9.81)});
    WindowState second;
    second.t = at_rest.back().t;
    second.imu = Preintegration(at_rest, ImuBias(), ImuNoiseDensities());
    second.imu_sqrt_information = Matrix15d::Identity();
    second.now.v_WB.x() = std::sqrt(9.0 * mean_square);
    window.states.push_back(second);
  }
  std::optional<CalibrationVector> update(CalibrationWatch* watch, double seconds) {
    output.t += static_cast<TimeNs>(1e9 * seconds);
    const auto deviation = watch->update(window, output);
    if (deviation) setCalibration(*deviation, &window);
    return deviation;
  }
};

CalibrationFinding findingOf(const CalibrationWatch& watch, const std::string& quantity) {
  for (const CalibrationFinding& finding : watch.findings())
    if (finding.quantity == quantity) return finding;
  ADD_FAILURE() << "nothing about the " << quantity;
  return {};
}

TEST(CalibrationInformation, IsWhatThePriorSaysWithTheStatesMarginalised) {
  Measured measured;
  measured.measure(kTimeOffset, 0.003, 0.001);
  // What a state shares with the column tells nothing of it while the state is unknown.
  measured.window.prior.A(measured.window.prior.rows() - 1, kCalibrationSize + 7) = 1e3;
  const auto shared = calibrationInformation(measured.window.prior);
  ASSERT_TRUE(shared.has_value());
  const double before = 1.0 / std::pow(calibrationPriorSigma()[kTimeOffset], 2);
  EXPECT_NEAR(shared->matrix(kTimeOffset, kTimeOffset), before + 1.0, 0.1);
  measured.measure(kTimeOffset, 0.003, 0.001);
  const auto own = calibrationInformation(measured.window.prior);
  EXPECT_NEAR(own->matrix(kTimeOffset, kTimeOffset), before + 1e6, 2.0);
  EXPECT_NEAR(own->vector[kTimeOffset], 0.003 * 1e6, 1.0);
}

TEST(CalibrationWatch, BelievesNothingBeforeTheOdometryHasSettled) {
  Measured measured;
  measured.measure(kTimeOffset, 0.004, 2e-5);
  measured.output.covariance.block<3, 3>(6, 6) = 0.01 * Eigen::Matrix3d::Identity();  // 0.1 m/s
  CalibrationWatch watch{CalibrationOptions()};
  for (int k = 0; k < 5; ++k) EXPECT_FALSE(measured.update(&watch, 2.0));
  EXPECT_EQ(findingOf(watch, "time offset").verdict, Verdict::kNotObserved);
  EXPECT_THAT(findingOf(watch, "time offset").words, HasSubstr("had not settled"));
  EXPECT_NEAR(findingOf(watch, "time offset").sigma[0], 5.0, 1e-9);  // ms, as before the flight
}

TEST(CalibrationWatch, CorrectsWhatIsCertainlyWrongAndSaysSoOnce) {
  Measured measured;
  measured.measure(kTimeOffset, 0.004, 2e-5);
  measured.measure(kFocal, 1e-4, 1e-4);  // as given
  CalibrationWatch watch{CalibrationOptions()};
  const auto deviation = measured.update(&watch, 0.05);
  ASSERT_TRUE(deviation.has_value());
  EXPECT_NEAR((*deviation)[kTimeOffset], 0.004, 1e-6);
  EXPECT_EQ(deviation->tail<kCalibrationSize - 1>().norm(), 0.0);  // nothing else
  const std::vector<std::string> remarks = watch.takeRemarks();
  ASSERT_EQ(remarks.size(), 1U);
  // 0.02 ms, three times that while nothing is known of how it moves, and what tracks share.
  EXPECT_EQ(remarks[0],
            "time offset: off by +4.00 ms +- 0.12 (the images are later than their stamps); "
            "corrected");
  EXPECT_FALSE(measured.update(&watch, 0.5));  // it is asked once a second
  EXPECT_FALSE(measured.update(&watch, 0.6));  // and has the same estimate
  EXPECT_TRUE(watch.takeRemarks().empty());
  EXPECT_EQ(findingOf(watch, "time offset").verdict, Verdict::kOff);
  EXPECT_EQ(findingOf(watch, "focal lengths").verdict, Verdict::kAgrees);
  EXPECT_THAT(findingOf(watch, "focal lengths").words, HasSubstr("agrees with what was given"));
  EXPECT_EQ(findingOf(watch, "principal points").verdict, Verdict::kNotObserved);
}

TEST(CalibrationWatch, WhatWasCorrectedOnceFollowsTheEstimateAlsoWhereThatIsNearWhatWasGiven) {
  Measured measured;
  measured.measure(kTimeOffset, 0.004, 2e-5);
  CalibrationWatch watch{CalibrationOptions()};
  ASSERT_TRUE(measured.update(&watch, 0.05));
  // One that is known far better: 0.2 ms, two standard deviations with what tracks share.
  measured.measure(kTimeOffset, 2e-4, 1e-7);
  ASSERT_TRUE(measured.update(&watch, 1.1));
  EXPECT_EQ(findingOf(watch, "time offset").verdict, Verdict::kAgrees);
  EXPECT_NEAR(measured.window.calibration.now[kTimeOffset], 2e-4, 1e-6);
  EXPECT_THAT(findingOf(watch, "time offset").words, HasSubstr("the estimate is used"));
}

TEST(CalibrationWatch, ACorrectionFollowsNoChangeThatIsShortBesideWhatIsKnown) {
  for (const double step : {1e-5, 3e-5}) {
    Measured measured;
    measured.measure(kTimeOffset, 0.004, 2e-5);
    CalibrationWatch watch{CalibrationOptions()};
    ASSERT_TRUE(measured.update(&watch, 0.05));
    // The mean of both moves by half the step; a standard deviation is 1.4e-5 s.
    measured.measure(kTimeOffset, 0.004 + step, 2e-5);
    EXPECT_EQ(measured.update(&watch, 1.1).has_value(), step > 2e-5);
  }
}

TEST(CalibrationWatch, RefusesWhatNoCalibrationCanBeOffBy) {
  for (const CalibrationMode mode : {CalibrationMode::kAuto, CalibrationMode::kOn}) {
    Measured measured;
    measured.measure(kBaseline, -0.08, 1e-3);
    CalibrationOptions options;
    options.extrinsics = mode;
    options.accel_scale_sigma = 0.0;
    CalibrationWatch watch{options};
    measured.update(&watch, 0.05);
    EXPECT_EQ(measured.window.calibration.now[kBaseline], 0.0);
    const CalibrationFinding finding = findingOf(watch, "baseline");
    EXPECT_EQ(finding.verdict, Verdict::kImplausible);
    EXPECT_THAT(finding.words, HasSubstr("farther than a calibration can be"));
    EXPECT_TRUE(finding.used.isZero(0.0));
  }
}

TEST(CalibrationWatch, ABaselineIsNoBetterThanTheAccelerometer) {
  Measured measured;
  measured.measure(kBaseline, 0.006, 1e-3);
  CalibrationOptions options;
  CalibrationWatch of_any{options};
  EXPECT_FALSE(measured.update(&of_any, 0.05));
  EXPECT_NEAR(findingOf(of_any, "baseline").sigma[0], 100.0 * std::hypot(0.005, 0.003, 0.001),
              0.01);
  options.accel_scale_sigma = 0.0;
  CalibrationWatch of_exact{options};
  for (int k = 0; k < 20; ++k) measured.update(&of_exact, 1.0);  // it does not move: no widening
  EXPECT_THAT(findingOf(of_exact, "baseline").words, HasSubstr("the given one is too short"));
  EXPECT_NEAR(measured.window.calibration.now[kBaseline], 0.006, 1e-4);
}

TEST(CalibrationWatch, AFocalLengthIsNoBetterThanTheGyro) {
  // What a gyro that reads 3 % too much makes of lenses that are as given.
  Measured measured;
  for (Eigen::Index c = 0; c < 2; ++c) measured.measure(kFocal + c, -0.022, 1e-4);
  CalibrationOptions options;
  CalibrationWatch of_any{options};
  EXPECT_FALSE(measured.update(&of_any, 0.05));
  const CalibrationFinding finding = findingOf(of_any, "focal lengths");
  EXPECT_NEAR(finding.sigma[0], 100.0 * std::hypot(0.01, 3e-4, 5e-4), 0.01);
  EXPECT_THAT(finding.words, HasSubstr("not certain enough"));
  options.gyro_scale_sigma = 0.0;
  CalibrationWatch of_exact{options};
  EXPECT_TRUE(measured.update(&of_exact, 0.05));
  EXPECT_THAT(findingOf(of_exact, "focal lengths").words, HasSubstr("corrected"));
}

/** Standard deviations that are hardly less than before the flight hide no gross error. */
TEST(CalibrationWatch, WhatIsFarFromZeroIsSaidHoweverLittleWasTold) {
  for (const double value : {-0.01, -0.05}) {
    Measured measured;
    measured.measure(kBaseline, value, 5e-3);
    CalibrationWatch watch{CalibrationOptions()};
    measured.update(&watch, 0.05);
    EXPECT_THAT(findingOf(watch, "baseline").words,
                HasSubstr(value < -0.02 ? "perhaps off by -4.0 %" : "not observed"));
  }
}

/** Of a noisy IMU the estimates follow the errors. */
TEST(CalibrationWatch, AnImuThatContradictsTheImagesWidensAndIsSaidOnce) {
  for (const double mean_square : {0.3, 25.0}) {
    Measured measured;
    measured.measure(kTimeOffset, 0.001, 2e-5);
    measured.contradict(mean_square);
    CalibrationWatch watch{CalibrationOptions()};
    std::vector<std::string> remarks;
    for (int k = 0; k < 10; ++k) {
      measured.update(&watch, 1.0);
      for (const std::string& remark : watch.takeRemarks()) remarks.push_back(remark);
    }
    // 0.06 ms, five times that where the residuals are, and what tracks share.
    const bool noisy = mean_square > 1.0;
    EXPECT_NEAR(findingOf(watch, "time offset").sigma[0], std::hypot(noisy ? 0.3 : 0.06, 0.1),
                1e-3);
    EXPECT_EQ(measured.window.calibration.now[kTimeOffset] != 0.0, !noisy);
    EXPECT_THAT(remarks, ElementsAre(HasSubstr(noisy ? "the IMU contradicts the images 5 times"
                                                     : "time offset: off by")));
  }
}

TEST(CalibrationWatch, DoubtIsSaid) {
  Measured measured;
  measured.measure(kTimeOffset, 4e-4, 5e-5);  // 0.4 ms +- 0.18, widened
  CalibrationWatch watch{CalibrationOptions()};
  EXPECT_FALSE(measured.update(&watch, 0.05));
  EXPECT_EQ(findingOf(watch, "time offset").verdict, Verdict::kAgrees);
  EXPECT_THAT(findingOf(watch, "time offset").words,
              HasSubstr("perhaps off by +0.40 ms +- 0.18, which is not certain enough"));
}

TEST(CalibrationWatch, AnEstimateThatWandersIsKnownWorse) {
  // Every five seconds it moves by three times what its variance loses.
  Measured measured;
  CalibrationWatch watch{CalibrationOptions()};
  const double sigma = 1e-4;
  measured.measure(kTimeOffset, 0.0, sigma);
  measured.update(&watch, 0.05);
  double information = 1.0, sum = 0.0;
  for (int k = 1; k <= 8; ++k) {
    const double lost = sigma * sigma * (1.0 / information - 1.0 / (information + 1.0));
    const double to = 3.0 * std::sqrt(lost) * (k % 2 ? 1.0 : -1.0) + sum / information;
    measured.measure(kTimeOffset, to * (information + 1.0) - sum, sigma);
    sum = to * (information + 1.0);
    information += 1.0;
    measured.update(&watch, 5.0);
  }
  const CalibrationFinding finding = findingOf(watch, "time offset");
  EXPECT_NEAR(finding.formal_sigma[0], 1e3 * sigma / 3.0, 1e-3);
  // Three times, and 0.1 ms that no flight averages out.
  EXPECT_NEAR(finding.sigma[0], std::hypot(3.0 * finding.formal_sigma[0], 0.1), 0.01);
}

TEST(CalibrationWatch, OnFollowsTheEstimateAndOffLooksAway) {
  Measured measured;
  measured.measure(kTimeOffset, 1e-4, 5e-5);
  measured.measure(kFocal, 0.003, 1e-5);
  CalibrationOptions options;
  options.time_offset = CalibrationMode::kOn;
  options.intrinsics = CalibrationMode::kOff;
  CalibrationWatch watch{options};
  const auto deviation = measured.update(&watch, 0.05);
  ASSERT_TRUE(deviation.has_value());
  EXPECT_NEAR((*deviation)[kTimeOffset], 1e-4, 1e-6);
  EXPECT_EQ((*deviation)[kFocal], 0.0);
  EXPECT_THAT(findingOf(watch, "time offset").words, HasSubstr("the estimate is used"));
  for (const CalibrationFinding& finding : watch.findings()) EXPECT_NE(finding.group, "intrinsics");
}

TEST(CalibrationOptions, AreKeysOfTheOdometry) {
  CalibrationOptions options;
  ParameterSet set("odometry");
  options.declare(set);
  IniFile ini;
  ini.setFromArgument("odometry.calibrate_extrinsics=on");
  ini.setFromArgument("odometry.calibrate_time_offset=off");
  set.read(ini);
  EXPECT_EQ(options.extrinsics, CalibrationMode::kOn);
  EXPECT_EQ(options.time_offset, CalibrationMode::kOff);
  EXPECT_EQ(options.intrinsics, CalibrationMode::kAuto);
  EXPECT_TRUE(options.any());
  EXPECT_STREQ(toString(Verdict::kImplausible), "implausible");
  EXPECT_STREQ(toString(Verdict::kNotObserved), "not_observed");
}

}  // namespace
}  // namespace etalon::fixed_lag
