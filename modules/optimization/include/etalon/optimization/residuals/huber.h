#pragma once

namespace etalon {

/** Weight of a residual of that norm in the normal equations of Huber's loss: 1 up to `width`. */
inline double huberWeight(double norm, double width) { return norm > width ? width / norm : 1.0; }

/** Huber's loss of a residual of that norm, half its square up to `width`. */
inline double huberLoss(double norm, double width) {
  return norm > width ? width * (norm - 0.5 * width) : 0.5 * norm * norm;
}

}  // namespace etalon
