#pragma once

namespace etalon {

/** z with P(N(0, 1) > z) = `tail`, 1e-12 < tail < 1. */
double normalQuantile(double tail);

/**
 * Quantile of the chi-square distribution for `dof` > 0 degrees of freedom, not necessarily whole;
 * `z` is that of the normal distribution. Wilson and Hilferty, The distribution of chi-square, PNAS
 * 1931: good to 3e-4 of itself for dof of 100 and more, to 2 % down to 3 and to 4 % at 1 (upper
 * tails of 1e-3 to 0.1).
 */
double chiSquareQuantile(double dof, double z);

}  // namespace etalon
