#pragma once

#include <Eigen/Core>
#include <array>

namespace etalon::ground_truth {

/** The sizes of all errors, in the order of the vectors of their logarithms. The first four are
 * factors of the data sheet's densities, in the order of ImuSource. */
enum ErrorSize {
  kGyroNoiseFactor,
  kGyroWalkFactor,
  kAccelNoiseFactor,
  kAccelWalkFactor,
  kPositionWhite,       ///< m
  kPositionCorrelated,  ///< m
  kPositionTime,        ///< s
  kRotationWhite,       ///< rad
  kRotationCorrelated,  ///< rad
  kRotationTime,        ///< s
  kPositionBandwidth,   ///< Hz
  kRotationBandwidth,   ///< Hz
  kErrorSizes
};

using SizeVector = Eigen::Matrix<double, kErrorSizes, 1>;
using SizeMatrix = Eigen::Matrix<double, kErrorSizes, kErrorSizes>;

/** What is believed of a size before the data are seen: log-normal. Wide: a factor of 3 to 10. They
 * keep a size that the data do not determine where it can be. */
struct SizePrior {
  double value;      ///< the most probable one
  double log_sigma;  ///< standard deviation of its natural logarithm; zero: it is known
};
using SizePriors = std::array<SizePrior, kErrorSizes>;

SizePriors defaultSizePriors();

/** The logarithms of the priors' values. */
SizeVector logOf(const SizePriors& priors);

}  // namespace etalon::ground_truth
