#include "scripted_flight.h"

#include "etalon/simulation/euroc_rig.h"
#include "etalon/simulation/imu_synthesis.h"
#include "etalon/simulation/room.h"
#include "etalon/simulation/stereo_renderer.h"

namespace etalon::pipeline_test {

IMPLEMENTS_MRPT_OBJECT(Scripted, etalon::Initializer, etalon::pipeline_test)

namespace {

ProfileOptions options() {
  ProfileOptions o;
  o.duration_s = (kFirstFrame + kFrames) / kFrameRateHz;
  o.rest_s = 0.0;
  return o;
}

}  // namespace

Flight::Flight() : trajectory(options()), calibration(eurocCalibration()) {
  for (CameraCalibration& camera : calibration.cameras) camera.rate_hz = kFrameRateHz;
  const StereoRenderer renderer(makeRoom(trajectory), calibration);
  for (int k = 0; k < kFrames; ++k) {
    StereoFrame frame;
    frame.t = stampAtRate(trajectory.start(), kFrameRateHz, kFirstFrame + k);
    frame.left = renderer.render(0, trajectory, frame.t);
    frame.right = renderer.render(1, trajectory, frame.t);
    frames.push_back(frame);
  }
  imu = synthesizeImu(trajectory, frames.front().t, trajectory.end(),
                      ImuSynthesisOptions::noiseFree())
            .samples;
}

const Flight& Flight::instance() {
  static const Flight flight;
  return flight;
}

InitializationResult trueInitialization(const InitializationProblem& problem) {
  Initialization result;
  for (int k = 0; k < problem.keyframeCount(); ++k) {
    const TimeNs t = problem.keyframe(k).t;
    const auto state = Flight::instance().trajectory.at(t);
    result.states.push_back({t, state.T_WB, state.v_WB});
  }
  result.covariance = Eigen::MatrixXd::Identity(11, 11) * 1e-6;
  return result;
}

double positionError(const FrameEstimate& estimate) {
  return (estimate.nav.T_WB.t - Flight::instance().truth(estimate.t).t).norm();
}

}  // namespace etalon::pipeline_test
