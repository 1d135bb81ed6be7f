#include "window.h"

#include <algorithm>
#include <cmath>

#include "etalon/core/so3.h"

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
  Eigen::Index column = calibrationColumns();
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

/** To first order in the offset. */
static void placeImage(double time_offset, WindowState* state) {
  state->T_BI = {expSO3(time_offset * state->twist_B.head<3>()),
                 time_offset * state->twist_B.tail<3>()};
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

void addCalibrationColumns(const StereoInertialCalibration& given, Window* window) {
  window->calibration.unknown = true;
  window->calibration.given = given;
  const LinearRows of_state = window->prior;
  window->prior =
      LinearRows(of_state.rows() + kCalibrationSize, of_state.unknowns() + kCalibrationSize);
  window->prior.A.topLeftCorner<kCalibrationSize, kCalibrationSize>() =
      calibrationPriorSigma().cwiseInverse().asDiagonal();
  window->prior.A.bottomRightCorner(of_state.rows(), of_state.unknowns()) = of_state.A;
  window->prior.b.tail(of_state.rows()) = of_state.b;
  window->reindex();
}

void setCalibration(const CalibrationVector& deviation, Window* window) {
  WindowCalibration& calibration = window->calibration;
  const StereoInertialCalibration before = corrected(calibration.given, calibration.now);
  const StereoInertialCalibration after = corrected(calibration.given, deviation);
  calibration.now = deviation;
  for (size_t c = 0; c < 2; ++c) window->T_CB[c] = after.cameras[c].T_BC.inverse();
  for (WindowState& state : window->states) placeImage(deviation[kTimeOffset], &state);
  for (size_t c = 0; c < 2; ++c) {
    const CameraModel &old = before.cameras[c].model, &now = after.cameras[c].model;
    if (old == now) continue;
    for (auto& [id, landmark] : window->landmarks)
      for (LandmarkObservation& o : landmark.observations)
        if (o.first() <= c && c < o.end())
          o.measurements[c] = remeasured(old, now, o.measurements[c]);
  }
}

/** The rate that turns the body between the stamp `t` and the image, from the samples on the image's
 * side of it: their mean over as long as the offset, because a sample's own vibration, times the
 * offset, would make the offset look smaller. */
static Eigen::Vector3d rateAt(TimeNs t, const std::vector<ImuSample>& imu, double time_offset) {
  const TimeNs reach = durationNs(std::abs(time_offset));
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  int count = 0;
  for (const ImuSample& sample : imu) {
    if (std::abs(sample.t - t) > reach) continue;
    sum += sample.gyro;
    ++count;
  }
  if (count > 0) return sum / static_cast<double>(count);
  const ImuSample &first = imu.front(), &last = imu.back();
  return std::abs(first.t - t) < std::abs(last.t - t) ? first.gyro : last.gyro;
}

void updateImageTimes(Window* window) {
  if (!window->calibration.unknown) return;
  for (size_t i = window->firstFull(); i < window->states.size(); ++i) {
    WindowState& state = window->states[i];
    const bool is_first = state.imu.samples().empty(), is_newest = i + 1 == window->states.size();
    if (is_first && is_newest) continue;
    // Of the newest frame the samples after the stamp have not come yet.
    const bool after = is_first || (window->calibration.now[kTimeOffset] > 0.0 && !is_newest);
    const std::vector<ImuSample>& imu = (after ? window->states[i + 1] : state).imu.samples();
    state.twist_B << rateAt(state.t, imu, window->calibration.now[kTimeOffset]) -
                         state.now.bias.gyro,
        state.now.T_WB.R.transpose() * state.now.v_WB;
    placeImage(window->calibration.now[kTimeOffset], &state);
  }
}

void appendState(Preintegration preintegration, Window* window) {
  const WindowState& last = window->states.back();
  WindowState state;
  state.serial = last.serial + 1;
  state.t = preintegration.end();
  state.now = state.linearization = preintegration.predict(last.now, window->g_W);
  state.imu_sqrt_information = inertialSqrtInformation(preintegration);
  state.imu = std::move(preintegration);
  state.column = last.column + last.size();
  window->states.push_back(std::move(state));
}

void moveWorld(const SE3& T_WW0, Window* window) {
  const Matrix15d back = errorsTurned(T_WW0.R).transpose();
  for (WindowState& state : window->states) {
    state.now = state.now.moved(T_WW0);
    state.linearization = state.linearization.moved(T_WW0);
    if (state.column + state.size() > window->prior.unknowns()) continue;
    auto columns = window->prior.A.middleCols(state.column, state.size());
    columns = (columns * back.topLeftCorner(state.size(), state.size())).eval();
  }
}

RelativeJacobians relativeJacobians(const SE3& T_WH, const SE3& T_WT) {
  const SE3 T_HT = relativePose(T_WH, T_WT);
  RelativeJacobians J;
  J.by_target.setIdentity();
  J.by_target.bottomRightCorner<3, 3>() = T_WH.R.transpose();
  J.by_host.setZero();
  J.by_host.topLeftCorner<3, 3>() = -T_HT.R.transpose();
  J.by_host.bottomLeftCorner<3, 3>() = hat(T_HT.t);
  J.by_host.bottomRightCorner<3, 3>() = -T_WH.R.transpose();
  return J;
}

Eigen::Matrix<double, 6, 6> relativeCovariance(const SE3& T_WH, const SE3& T_WT,
                                               const Eigen::Matrix<double, 12, 12>& joint) {
  const RelativeJacobians J = relativeJacobians(T_WH, T_WT);
  Eigen::Matrix<double, 6, 12> both;
  both << J.by_host, J.by_target;
  return both * joint * both.transpose();
}

}  // namespace etalon::fixed_lag
