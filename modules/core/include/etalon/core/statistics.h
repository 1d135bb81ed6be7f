#pragma once

#include <vector>

namespace etalon {

/**
 * The value in the middle; of an even number the upper of the two, so that it is one of the values.
 * quantile(values, 0.5) takes their mean. NaN of none, or if one is NaN.
 */
double median(std::vector<double> values);

/**
 * Quantile by linear interpolation between order statistics (type 7 of Hyndman and Fan, American
 * Statistician 1996): the value at position q (n - 1) of the sorted set, counted from 0. NaN of
 * none, or if one is NaN.
 * @param q in [0, 1]
 */
double quantile(std::vector<double> values, double q);

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
