#include "likelihood.h"

#include <gtest/gtest.h>

#include <cmath>

#include "simulated_truth.h"
#include "size_search.h"
#include "smooth_error.h"
#include "standard_errors.h"

namespace etalon::ground_truth {
namespace {

/** A short flight, fitted once with the most probable sizes. */
class ShortFlight : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    truth_ = new SimulatedTruth(simulatedTruth({}, 2, 14.0));
    imu_ = new ImuBuffer(truth_->imu);
    std::vector<StampedState> rows(truth_->recorded.states.begin(),
                                   truth_->recorded.states.end() - 10);
    model_ = new FlightModel(rows, *imu_, ImuNoiseDensities(), 0.1, 0.5);
    for (int i = 0; i < 3; ++i) {
      const Linearisation linear = model_->linearise();
      Posterior posterior;
      ASSERT_TRUE(
          Likelihood(linear, defaultSizePriors()).solve(logOf(defaultSizePriors()), &posterior));
      model_->add(posterior.nodes, posterior.border);
    }
    linear_ = new Linearisation(model_->linearise());
  }
  static void TearDownTestSuite() {
    delete linear_;
    delete model_;
    delete imu_;
    delete truth_;
  }

  static SimulatedTruth* truth_;
  static ImuBuffer* imu_;
  static FlightModel* model_;
  static Linearisation* linear_;
};
SimulatedTruth* ShortFlight::truth_ = nullptr;
ImuBuffer* ShortFlight::imu_ = nullptr;
FlightModel* ShortFlight::model_ = nullptr;
Linearisation* ShortFlight::linear_ = nullptr;

TEST_F(ShortFlight, SlopeIsThatOfTheObjective) {
  const SizePriors priors = defaultSizePriors();
  Likelihood likelihood(*linear_, priors);
  const SizeVector sizes = logOf(priors);
  Posterior posterior;
  ASSERT_TRUE(likelihood.solve(sizes, &posterior));
  const SizeVector slope = likelihood.slope().total;
  constexpr double kStep = 1e-3;
  for (int i = 0; i < kErrorSizes; ++i) {
    Posterior up, down;
    ASSERT_TRUE(likelihood.solve(sizes + kStep * SizeVector::Unit(i), &up));
    ASSERT_TRUE(likelihood.solve(sizes - kStep * SizeVector::Unit(i), &down));
    // The bandwidths' own slope is a difference of one side with a step of 1e-4.
    const double numeric = (up.objective - down.objective) / (2.0 * kStep);
    EXPECT_NEAR(slope[i], numeric, 1e-3 * (1.0 + std::abs(numeric))) << "size " << i;
  }
}

TEST_F(ShortFlight, SlopesOfTheBlocksSumUp) {
  Likelihood likelihood(*linear_, defaultSizePriors());
  Posterior posterior;
  // At the priors' values their own slope is zero.
  ASSERT_TRUE(likelihood.solve(logOf(defaultSizePriors()), &posterior));
  const Slope slope = likelihood.slope(blocksOf(linear_->nodes, 3.0));
  ASSERT_EQ(slope.of_blocks.size(), 5u);
  SizeVector sum = SizeVector::Zero();
  for (const SizeVector& block : slope.of_blocks) sum += block;
  EXPECT_LT((sum - slope.total).norm(), 1e-9 * (1.0 + slope.total.norm()));
}

TEST_F(ShortFlight, KnownSizesStay) {
  SizePriors priors = defaultSizePriors();
  priors[kPositionBandwidth] = {1e6, 0.0};
  Likelihood likelihood(*linear_, priors);
  const SizeVector found = searchSizes(&likelihood, logOf(priors)).log_sizes;
  EXPECT_EQ(found[kPositionBandwidth], std::log(1e6));
  Posterior before, after;
  ASSERT_TRUE(likelihood.solve(logOf(priors), &before));
  ASSERT_TRUE(likelihood.solve(found, &after));
  EXPECT_LT(after.objective, before.objective);
}

TEST_F(ShortFlight, ResidualsMoveAsTheirDerivativesSay) {
  constexpr double kStep = 1e-6;
  const auto rows = linear_->rows(1e6, 1e6);  // without low pass
  for (int i = 0; i < kGravity; ++i) {
    FlightModel moved = *model_;
    moved.add(std::vector<NodeVector>(moved.size(), NodeVector::Zero()),
              kStep * BorderVector::Unit(i));
    const auto after = moved.linearise().rows(1e6, 1e6);
    const size_t k = rows.size() / 2;
    // The shift's derivative has the rate as a mean over 10 ms; a nanosecond is a stamp's last digit.
    const double tolerance = i < kTurn ? 0.05 : 1e-4;
    EXPECT_LT(((after[k].position - rows[k].position) / kStep - rows[k].G_position.col(i)).norm(),
              tolerance)
        << i;
    EXPECT_LT(((after[k].rotation - rows[k].rotation) / kStep - rows[k].G_rotation.col(i)).norm(),
              tolerance)
        << i;
  }
}

TEST_F(ShortFlight, LeavingABlockOutMakesItLessCertain) {
  Likelihood likelihood(*linear_, defaultSizePriors());
  Posterior all, fewer;
  ASSERT_TRUE(likelihood.solve(logOf(defaultSizePriors()), &all));
  ASSERT_TRUE(likelihood.solve(logOf(defaultSizePriors()), &fewer, {30, 80}));
  for (int i = 0; i < kBorderSize; ++i)
    EXPECT_GE(fewer.border_covariance(i, i), all.border_covariance(i, i)) << i;
}

TEST_F(ShortFlight, RowsAreBelievedEveryHalfSecond) {
  TimeNs last = 0;
  for (const Node& node : model_->nodes()) {
    if (!node.counts) continue;
    if (last > 0) {
      EXPECT_NEAR(secondsBetween(last, node.body.t), 0.5, 1e-6);
    }
    last = node.body.t;
  }
  EXPECT_GT(last, 0);
}

TEST(SmoothError, TwoStepsAreOneOfTwice) {
  for (const double a : {1e-4, 0.03, 0.8}) {
    const Transition one = transition(a), two = transition(2.0 * a);
    EXPECT_LT((one.F * one.F - two.F).norm(), 1e-13);
    const Eigen::Matrix2d composed = one.F * one.covariance * one.F.transpose() + one.covariance;
    // The series below a step of 1e-3 leaves out a^5.
    EXPECT_LT((composed - two.covariance).norm(), 1e-12) << a;
  }
}

TEST(SmoothError, CorrelationIsMatern) {
  const Transition step = transition(0.7);
  EXPECT_NEAR(step.F(0, 0), 1.7 * std::exp(-0.7), 1e-15);
  EXPECT_GT(step.covariance.determinant(), 0.0);
}

TEST(StandardErrors, BlocksAreAlikeAndFiveAtLeast) {
  std::vector<Node> nodes(100);
  for (size_t k = 0; k < nodes.size(); ++k) nodes[k].body.t = durationNs(static_cast<double>(k));
  EXPECT_EQ(blocksOf(nodes, 1000.0), (std::vector<size_t>{0, 20, 40, 60, 80}));
  EXPECT_EQ(blocksOf(nodes, 9.9).size(), 10u);
}

}  // namespace
}  // namespace etalon::ground_truth
