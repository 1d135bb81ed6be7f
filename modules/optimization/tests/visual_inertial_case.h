#pragma once

#include <cmath>
#include <limits>
#include <vector>

#include "etalon/core/symmetric.h"
#include "etalon/optimization/bundle/visual_inertial_ba.h"
#include "etalon/testing/known_landmarks.h"
#include "etalon/testing/synthetic_window.h"

namespace etalon {

/** A synthetic window as a problem of visual-inertial BA that starts at the truth. */
struct VisualInertialCase {
  VisualInertialCase(const testing::SyntheticWindowOptions& options, double sigma_px)
      : synthetic(testing::makeSyntheticWindow(options)),
        window(buildVisualWindow(synthetic.calibration, synthetic.keyframes(), sigma_px)) {
    for (const StampedState& s : synthetic.truth) states.push_back(s);
    landmarks = synthetic.landmarks;
    for (size_t k = 1; k < states.size(); ++k)
      preintegrations.emplace_back(
          synthetic.imu.between(synthetic.truth[k - 1].t, synthetic.truth[k].t), options.bias,
          synthetic.calibration.imu.noise);
  }
  VisualInertialBaResult solve(const VisualInertialBaOptions& options) const {
    return solveVisualInertialBa({BundleProblem(window, testing::knownLandmarks(landmarks)),
                                  preintegrations, states, synthetic.bias, priors, 9.81},
                                 options);
  }
  std::vector<StampedState> stamped(const VisualInertialBaResult& result) const {
    std::vector<StampedState> out;
    for (size_t k = 0; k < result.states.size(); ++k)
      out.emplace_back(synthetic.truth[k].t, result.states[k]);
    return out;
  }
  testing::SyntheticWindow synthetic;
  VisualWindow window;
  std::vector<NavState> states;
  std::vector<Eigen::Vector3d> landmarks;  ///< p_W by id
  std::vector<Preintegration> preintegrations;
  BiasPriors priors;
};

/** Standard deviation of the tilt of the first keyframe, the larger of the two axes, rad; infinite
 * without covariance. */
inline double sigmaTilt(const VisualInertialBaResult& result) {
  if (result.covariance.size() == 0) return std::numeric_limits<double>::infinity();
  const Eigen::Matrix<double, 2, 3> level = result.states.front().T_WB.R.topRows<2>();
  const Eigen::Matrix2d tilt = level * result.covariance.topLeftCorner<3, 3>() * level.transpose();
  return std::sqrt(symmetricEigenvalues(tilt)(1));
}

/** Largest standard deviation of a component of the last keyframe's velocity, m/s; infinite without
 * covariance. */
inline double sigmaVelocity(const VisualInertialBaResult& result) {
  if (result.covariance.size() == 0) return std::numeric_limits<double>::infinity();
  const Eigen::Index v = 9 * (result.states.size() - 1) + 6;
  return std::sqrt(result.covariance.diagonal().segment<3>(v).maxCoeff());
}

}  // namespace etalon
