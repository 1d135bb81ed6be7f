#pragma once

#include <vector>

namespace etalon {

/** Median of the norm of two standard normal coordinates, sqrt(2 ln 2) (Rayleigh's distribution). */
constexpr double kRayleighMedian = 1.17741;

/**
 * The value in the middle; of an even number the upper of the two, so that it is one of the values.
 * quantile(values, 0.5) takes their mean. NaN for an empty set or if a value is NaN.
 */
double median(std::vector<double> values);

/**
 * Quantile by linear interpolation between order statistics (type 7 of Hyndman and Fan, American
 * Statistician 1996): the value at position q (n - 1) of the sorted set, counted from 0. NaN for an
 * empty set or if a value is NaN.
 * @param q in [0, 1]
 */
double quantile(std::vector<double> values, double q);

/** Mean of those that are at most `largest`; NaN if none is. */
double meanUpTo(double largest, const std::vector<double>& values);

/**
 * The x that a chi-square variable of `dof` > 0 degrees of freedom, not necessarily whole, exceeds
 * with probability `tail`, 0 < tail < 1.
 */
double chiSquareQuantile(double dof, double tail);

}  // namespace etalon
