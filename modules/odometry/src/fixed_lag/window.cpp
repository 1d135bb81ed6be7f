#include "window.h"

#include <algorithm>

namespace etalon::fixed_lag {

size_t Window::firstFull() const {
  size_t i = 0;
  while (i < states.size() && !states[i].full) ++i;
  return i;
}

size_t Window::retainedCount() const {
  size_t count = 0;
  for (const WindowState& state : states) count += state.retained;
  return count;
}

void Window::reindex() {
  Eigen::Index column = 0;
  for (WindowState& state : states) {
    state.column = column;
    column += state.size();
  }
  const auto indexOf = [this](int serial) {
    for (size_t i = 0; i < states.size(); ++i)
      if (states[i].serial == serial) return static_cast<int>(i);
    return -1;
  };
  for (auto it = landmarks.begin(); it != landmarks.end();) {
    Landmark& landmark = it->second;
    auto& observations = landmark.observations;
    landmark.host = indexOf(landmark.host_serial);
    for (LandmarkObservation& o : observations) o.state = indexOf(o.serial);
    observations.erase(std::remove_if(observations.begin(), observations.end(),
                                      [](const LandmarkObservation& o) { return o.state < 0; }),
                       observations.end());
    if (landmark.host < 0 || observations.empty())
      it = landmarks.erase(it);
    else
      ++it;
  }
}

Window windowAt(const StereoInertialCalibration& calibration, const Eigen::Vector3d& g_W,
                const NavState& state, TimeNs t, const Matrix15d& L) {
  Window window;
  for (size_t c = 0; c < 2; ++c) window.T_CB[c] = calibration.cameras[c].T_BC.inverse();
  window.g_W = g_W;
  WindowState first;
  first.t = t;
  first.now = first.linearization = state;
  first.fixed = first.keyframe = true;
  window.states.push_back(std::move(first));
  window.reindex();
  window.prior = LinearRows(15, 15);
  window.prior.A = L;
  return window;
}

void appendState(Preintegration preintegration, Window* window) {
  const WindowState& last = window->states.back();
  WindowState state;
  state.serial = last.serial + 1;
  state.t = preintegration.end();
  state.now = state.linearization = preintegration.predict(last.now, window->g_W);
  state.imu_sqrt_information = inertialSqrtInformation(preintegration);
  state.imu = std::move(preintegration);
  window->states.push_back(std::move(state));
  window->reindex();
}

}  // namespace etalon::fixed_lag
