#include "smooth_error.h"

#include <cmath>

namespace etalon::ground_truth {

Transition transition(double a) {
  Transition t;
  t.F << 1.0 + a, a, -a, 1.0 - a;
  t.F *= std::exp(-a);
  // I - F F^T without the difference of nearly equal numbers.
  const double e = std::exp(-2.0 * a), rest = -std::expm1(-2.0 * a);
  t.covariance << rest - e * (2.0 * a + 2.0 * a * a), 2.0 * a * a * e, 2.0 * a * a * e,
      rest + e * (2.0 * a - 2.0 * a * a);
  // 1 - e^-2a (1 + 2a + 2a^2) = 4/3 a^3 - 2 a^4 + ...
  if (a < 1e-3) t.covariance(0, 0) = a * a * a * (4.0 / 3.0 - 2.0 * a);
  return t;
}

}  // namespace etalon::ground_truth
