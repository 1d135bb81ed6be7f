#include "relative_views.h"

#include <Eigen/Core>

namespace etalon::fixed_lag {

void RelativeViews::place(const Window& window) {
  const size_t n = window.states.size();
  turned_.resize(n);
  views_.resize(2 * n * n);
  std::vector<SE3> T_WI(n);
  std::vector<std::array<SE3, 2>> T_WC(n);
  const std::array<SE3, 2> T_BC = {window.T_CB[0].inverse(), window.T_CB[1].inverse()};
  for (size_t k = 0; k < n; ++k) {
    T_WI[k] = window.states[k].seenFrom();
    for (size_t c = 0; c < 2; ++c) T_WC[k][c] = T_WI[k] * T_BC[c];
  }
  for (size_t h = 0; h < n; ++h) {
    const WindowState& host = window.states[h];
    turned_[h].noalias() = host.linearization.T_WB.R * host.T_BI.R;
    // From the axes of the views to those of W: by how much the estimate is turned against the
    // linearisation point.
    const Eigen::Matrix3d R = T_WI[h].R * turned_[h].transpose();
    for (size_t k = 0; k < n; ++k)
      for (size_t c = 0; c < 2; ++c) {
        View& view = views_[(h * n + k) * 2 + c];
        view.R.noalias() = T_WC[k][c].R.transpose() * R;
        view.c.noalias() = R.transpose() * (T_WC[k][c].t - T_WI[h].t);
      }
  }
}

}  // namespace etalon::fixed_lag
