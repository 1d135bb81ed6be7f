#include "error_sizes.h"

#include <cmath>

namespace etalon::ground_truth {

SizePriors defaultSizePriors() {
  return {{
      {1.5, 0.2},   // gyro, noise
      {1.0, 0.1},   // gyro, walk
      {5.6, 0.5},   // accelerometer, noise
      {3.0, 0.7},   // accelerometer, walk
      {1e-3, 2.3},  // position, white
      {3e-3, 0.7},  // position, correlated
      {1.0, 1.0},   // its time
      {3e-4, 2.3},  // rotation, white
      {3e-3, 1.5},  // rotation, correlated
      {1.0, 1.0},   // its time
      {1.0, 0.35},  // position, bandwidth
      {1.0, 0.35},  // rotation, bandwidth
  }};
}

SizeVector logOf(const SizePriors& priors) {
  SizeVector logs;
  for (int i = 0; i < kErrorSizes; ++i) logs[i] = std::log(priors[i].value);
  return logs;
}

}  // namespace etalon::ground_truth
