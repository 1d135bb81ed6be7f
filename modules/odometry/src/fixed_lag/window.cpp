#include "window.h"

#include <algorithm>

namespace etalon::fixed_lag {

size_t Window::firstFull() const {
  size_t i = 0;
  while (i < states.size() && !states[i].full) ++i;
  return i;
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

}  // namespace etalon::fixed_lag
