#include "bundle/window_landmarks.h"

namespace etalon {

WindowLandmarks::WindowLandmarks(const BundleProblem& bundle, const std::vector<SE3>& T_WB)
    : held(bundle.landmarks.size(), 0) {
  const VisualWindow& window = bundle.window;
  landmarks.reserve(bundle.landmarks.size());
  for (size_t l = 0; l < bundle.landmarks.size(); ++l) {
    const VisualMeasurement& m = *window.measurementsOf(l).begin();
    const SE3 T_WC = T_WB[m.keyframe] * window.T_CB[m.camera].inverse();
    landmarks.emplace_back(bundle.landmarks[l].position, T_WC.t);
  }
}

void WindowLandmarks::holdAtInfinity(const VisualWindow& window, const std::vector<SE3>& T_WB) {
  for (size_t l = 0; l < landmarks.size(); ++l) {
    double& rho = landmarks[l].parameters.z();
    held[l] = 0;
    if (rho > 0.0) continue;
    rho = 0.0;
    double slope = 0.0;  // of half the sum of squares by rho
    for (const VisualMeasurement& m : window.measurementsOf(l)) {
      Eigen::Vector2d r;
      Eigen::Matrix<double, 2, 3> J;
      if (m.inlier && window.residual(m, T_WB, landmarks[l], &r, nullptr, &J))
        slope += J.col(2).dot(r);
    }
    held[l] = slope >= 0.0;
  }
}

void WindowLandmarks::store(BundleProblem* bundle) const {
  for (size_t l = 0; l < landmarks.size(); ++l)
    bundle->landmarks[l].position = landmarks[l].position();
}

}  // namespace etalon
