#include "low_pass.h"

#include <gtest/gtest.h>

#include <cmath>

namespace etalon::ground_truth {
namespace {

constexpr double kStep = 0.02;  // s

/** Amplitude of a sine of `hz` after the low pass, in the middle of a long signal. */
double passed(double hz, double bandwidth_hz, int order) {
  Eigen::MatrixXd signal(1, 4000);
  for (Eigen::Index k = 0; k < signal.cols(); ++k)
    signal(0, k) = std::sin(2.0 * M_PI * hz * kStep * static_cast<double>(k));
  return lowPassed(signal, {0}, kStep, bandwidth_hz, order).middleCols(1500, 1000).maxCoeff();
}

// The bilinear transform bends frequencies by (pi f step)^2 / 3: below 0.5 % here.
TEST(LowPass, ResponseIsThatOfASmoother) {
  for (const double hz : {0.25, 0.5, 1.0, 2.0}) {
    EXPECT_NEAR(passed(hz, 1.0, 2), 1.0 / (1.0 + std::pow(hz, 4.0)), 0.02) << hz;
    EXPECT_NEAR(passed(hz, 1.0, 1), 1.0 / (1.0 + std::pow(hz, 2.0)), 0.02) << hz;
  }
}

// The greatest sample is up to 1 - cos(pi / 25) / 4 below the sine's peak.
TEST(LowPass, WideOneChangesNothing) {
  EXPECT_NEAR(passed(2.0, 1e6, 2), 1.0, 3e-3);
  EXPECT_NEAR(passed(2.0, 1e6, 1), 1.0, 3e-3);
}

TEST(LowPass, StretchesDoNotTouchEachOther) {
  Eigen::MatrixXd signal = Eigen::MatrixXd::Zero(1, 200);
  signal.rightCols(100).setOnes();
  EXPECT_EQ(lowPassed(signal, {0, 100}, kStep, 1.0, 2), signal);
}

}  // namespace
}  // namespace etalon::ground_truth
