#include "residuals/shared_error_cost.h"

#include <gtest/gtest.h>

#include "cost_function_checks.h"
#include "etalon/core/so3.h"

namespace etalon {
namespace {

using Eigen::Vector3d;
using testing::expectJacobians;
using testing::kAttitudes;
using testing::kPosition;
using testing::poseValue;

TEST(SharedErrorCost, JacobianAgreesWithDifferences) {
  for (const Vector3d& attitude : kAttitudes)
    for (const Vector3d& off : {Vector3d(0, 0, 0), Vector3d(0.1, 0.2, -0.3)}) {
      const SE3 body(expSO3(attitude), kPosition);
      const SE3 seen(body.R * expSO3(off), body.t + Vector3d(0.1, -0.2, 0.3));
      expectJacobians(SharedErrorCost(1e-3), {poseValue(body), poseValue(seen)});
    }
}

}  // namespace
}  // namespace etalon
