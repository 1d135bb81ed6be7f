#include "low_pass.h"

#include <cmath>

namespace etalon::ground_truth {
namespace {

/** Direct form of the filter; `direction` is 1 or -1. The signal goes on at both ends as it ends. */
void pass(Eigen::MatrixXd* signal, Eigen::Index begin, Eigen::Index end, int direction, int order,
          double c) {
  // Second order: b (1 + z)^2 / (1 + a1 z + a2 z^2); first order: b (1 + z) / (1 + a1 z).
  const bool second = order == 2;
  const double q = std::sqrt(2.0) * c, a0 = second ? 1.0 + q + c * c : 1.0 + c;
  const double b = (second ? c * c : c) / a0, b1 = second ? 2.0 : 1.0, b2 = second ? 1.0 : 0.0;
  const double a1 = (second ? 2.0 * (c * c - 1.0) : c - 1.0) / a0;
  const double a2 = second ? (1.0 - q + c * c) / a0 : 0.0;
  const Eigen::Index first = direction > 0 ? begin : end - 1;
  Eigen::VectorXd x1 = signal->col(first), x2 = x1, y1 = x1, y2 = x1, y(x1.size());
  for (Eigen::Index n = 0; n < end - begin; ++n) {
    auto x = signal->col(first + direction * n);
    y = b * (x + b1 * x1 + b2 * x2) - a1 * y1 - a2 * y2;
    x2.swap(x1);
    x1 = x;
    y2.swap(y1);
    y1 = y;
    x = y;
  }
}

}  // namespace

Eigen::MatrixXd lowPassed(Eigen::MatrixXd signal, const std::vector<Eigen::Index>& begins,
                          double step_s, double bandwidth_hz, int order) {
  const double c = M_PI * bandwidth_hz * step_s;
  for (size_t i = 0; i < begins.size(); ++i) {
    const Eigen::Index end = i + 1 < begins.size() ? begins[i + 1] : signal.cols();
    if (end == begins[i]) continue;
    pass(&signal, begins[i], end, 1, order, c);
    pass(&signal, begins[i], end, -1, order, c);
  }
  return signal;
}

}  // namespace etalon::ground_truth
