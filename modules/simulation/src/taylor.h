#pragma once

#include <array>
#include <cmath>
#include <cstddef>

namespace etalon {

/**
 * A function of time around one instant as its truncated Taylor series: c[k] is the k-th derivative
 * divided by k!. Sums and products are exact up to the order kept.
 */
template <int N>
struct Taylor {
  std::array<double, N + 1> c{};

  static Taylor constant(double value) {
    Taylor s;
    s.c[0] = value;
    return s;
  }
  double value() const { return c[0]; }
  double rate() const { return c[1]; }

  Taylor operator+(const Taylor& b) const {
    Taylor s;
    for (size_t i = 0; i <= N; ++i) s.c[i] = c[i] + b.c[i];
    return s;
  }
  Taylor operator*(const Taylor& b) const {
    Taylor s;
    for (size_t i = 0; i <= N; ++i) {
      for (size_t j = 0; i + j <= N; ++j) s.c[i + j] += c[i] * b.c[j];
    }
    return s;
  }
  Taylor operator*(double f) const {
    Taylor s;
    for (size_t i = 0; i <= N; ++i) s.c[i] = c[i] * f;
    return s;
  }
};

/** amplitude sin(angular_frequency t + phase) around `t`. */
template <int N>
Taylor<N> sinusoid(double amplitude, double angular_frequency, double phase, double t) {
  Taylor<N> s;
  const double angle = angular_frequency * t + phase;
  double factor = amplitude;
  for (size_t k = 0; k <= N; ++k) {
    s.c[k] = factor * std::sin(angle + static_cast<double>(k) * 1.57079632679489661923);
    factor *= angular_frequency / static_cast<double>(k + 1);
  }
  return s;
}

/**
 * The polynomial step of degree 11 from 0 (t <= begin) to 1 (t >= begin + length): u^6 (462 - 1980
 * u + 3465 u^2 - 3080 u^3 + 1386 u^4 - 252 u^5), whose first five derivatives vanish at both ends.
 */
template <int N>
Taylor<N> smoothStep(double begin, double length, double t) {
  if (t <= begin) return {};
  if (t >= begin + length) return Taylor<N>::constant(1.0);
  Taylor<N> u;
  u.c[0] = (t - begin) / length;
  u.c[1] = 1.0 / length;
  Taylor<N> s = Taylor<N>::constant(-252.0);
  for (double coefficient : {1386.0, -3080.0, 3465.0, -1980.0, 462.0}) {
    s = s * u + Taylor<N>::constant(coefficient);
  }
  const Taylor<N> u3 = u * u * u;
  return s * u3 * u3;
}

}  // namespace etalon
