#include "bundle/slow_error.h"

#include <gtest/gtest.h>

#include "etalon/testing/synthetic_window.h"

namespace etalon {
namespace {

std::vector<Preintegration> intervals() {
  const testing::SyntheticWindow window = testing::makeSyntheticWindow({});
  std::vector<Preintegration> result;
  for (size_t k = 1; k < window.truth.size(); ++k)
    result.emplace_back(window.imu.between(window.truth[k - 1].t, window.truth[k].t), ImuBias(),
                        window.calibration.imu.noise);
  return result;
}

TEST(SlowErrorModes, FewHaveNearlyAllOfTheCovariance) {
  const std::vector<Preintegration> all = intervals();
  const SlowAcceleration slow{0.016, 0.68};
  const Eigen::MatrixXd modes = slowErrorModes(all, slow);
  ASSERT_EQ(modes.rows(), static_cast<Eigen::Index>(all.size()));
  EXPECT_LT(modes.cols(), modes.rows());
  const Eigen::MatrixXd covariance = modes * modes.transpose();
  for (Eigen::Index k = 0; k < modes.rows(); ++k)
    for (Eigen::Index l = 0; l < modes.rows(); ++l) {
      const double apart = all[0].dt() * static_cast<double>(k - l);
      EXPECT_NEAR(covariance(k, l), 0.016 * 0.016 * slow.correlation(apart), 0.01 * 0.016 * 0.016);
    }
}

TEST(SlowErrorModes, AreNoneWhereThereIsNoSlowError) {
  EXPECT_EQ(slowErrorModes(intervals(), SlowAcceleration()).cols(), 0);
}

}  // namespace
}  // namespace etalon
