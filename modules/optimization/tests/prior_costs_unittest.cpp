// The costs that state what is known before any measurement.

#include <gtest/gtest.h>

#include "cost_function_checks.h"
#include "etalon/core/so3.h"
#include "residuals/gauge_cost.h"

namespace etalon {
namespace {

using Eigen::Vector3d;
using testing::expectJacobians;
using testing::kAttitudes;
using testing::kPosition;
using testing::poseValue;
using testing::residual;

TEST(GaugeCost, JacobianAgreesWithDifferences) {
  for (const Vector3d& attitude : kAttitudes)
    for (const Vector3d& off : {Vector3d(0, 0, 0), Vector3d(1e-9, 2e-9, 0),
                                Vector3d(0.1, 0.2, -0.3), Vector3d(1.2, 0.8, -1.5)}) {
      const SE3 reference(expSO3(attitude), kPosition);
      const GaugeCost cost(reference);
      const SE3 T(reference.R * expSO3(off), reference.t + Vector3d(0.1, -0.2, 0.3));
      expectJacobians(cost, {poseValue(T)});
    }
}

TEST(GaugeCost, IsZeroWhereOnlyTheTiltDiffers) {
  const SE3 reference(expSO3({0.7, -1.1, 0.4}), kPosition);
  const GaugeCost cost(reference);
  const SE3 tilted(expSO3({0.3, -0.2, 0.0}) * reference.R, reference.t);
  // Rounding of 1e-16 times the inverse sigma of 1e5.
  EXPECT_LT(residual(cost, {poseValue(tilted)}).norm(), 1e-9);
  const SE3 turned(expSO3({0.0, 0.0, 0.1}) * reference.R, reference.t);
  EXPECT_NEAR(residual(cost, {poseValue(turned)})[3], 0.1 * kGaugeInverseSigma, 1e-6);
}

}  // namespace
}  // namespace etalon
