#pragma once

#include <vector>

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

}  // namespace etalon
