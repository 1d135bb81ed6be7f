#pragma once

namespace etalon {

/** Squared scale of the Cauchy loss of a pixel's two whitened coordinates. */
constexpr double kCauchyChi2 = 4.0;
/**
 * Factor of that loss. With Gaussian noise (s = r^2 exponential of mean 2, w = 1 / (1 + s /
 * kCauchyChi2)) Gauss-Newton's matrix has E[w] = 0.723 of the information, and the estimate's
 * variance is E[w^2 s] / 2 / (E[w] - E[w^2 s] / kCauchyChi2)^2 = 1.092 of the least: the loss is
 * scaled by 1 / (0.723 * 1.092), so that the covariance is the one that the estimate has.
 */
constexpr double kCauchyGain = 1.267;
/**
 * Width of the loss in standard deviations of a scalar residual with which it is 95 % as efficient on
 * normal residuals as least squares (Holland and Welsch, Robust regression using iteratively
 * reweighted least-squares, 1977).
 */
constexpr double kCauchyWidth = 2.385;

}  // namespace etalon
