#include "odometry_beginning.h"

#include <random>

#include "etalon/core/errors.h"

namespace etalon {

using Eigen::Vector3d;

Beginning fromTruth(const SequenceTracks& tracks, unsigned seed) {
  Beginning beginning;
  while (beginning.frame < tracks.frames.size() &&
         !tracks.ground_truth.at(tracks.frames[beginning.frame].t))
    ++beginning.frame;
  if (beginning.frame == tracks.frames.size()) throw ConfigError("no ground truth for any frame");
  const StampedState truth = *tracks.ground_truth.at(tracks.frames[beginning.frame].t);
  Eigen::Matrix<double, 15, 1> sigma;  // as a good initialization has them
  sigma << Vector3d::Constant(0.005), Vector3d::Constant(1e-4), Vector3d::Constant(0.02),
      Vector3d::Constant(0.003), Vector3d::Constant(0.05);
  std::mt19937_64 generator(seed);
  std::normal_distribution<double> normal;
  Eigen::Matrix<double, 15, 1> error;
  for (int i = 0; i < 15; ++i) error[i] = sigma[i] * normal(generator);
  beginning.start.state = truth.plus(error);
  beginning.start.covariance = sigma.cwiseAbs2().asDiagonal();
  return beginning;
}

Beginning fromInitializer(const SequenceTracks& tracks, const SuiteConfiguration& suite) {
  const auto first = firstStart(tracks, suite.pipeline, *suite.initializers[0].initializer);
  if (!first) throw DataError("", 0, "no window was accepted");
  return *first;
}

void injectFault(const OdometryFault& fault, SequenceTracks* tracks) {
  std::vector<TrackedFrame> frames;
  constexpr LandmarkId kNewIds = 1'000'000'000;
  for (TrackedFrame& frame : tracks->frames) {
    const double t = secondsBetween(tracks->first_image, frame.t) - fault.at_s;
    const bool within = t >= 0.0 && t < fault.for_s;
    if (fault.kind == "drop" && within) continue;
    if (fault.kind == "black" && within) frame.observations.clear();
    for (Observation& o : frame.observations) {
      if (fault.kind == "right" && within) o.has_right = false;
      if ((fault.kind == "black" || fault.kind == "drop") && t >= 0.0) o.id += kNewIds;
    }
    frames.push_back(std::move(frame));
  }
  tracks->frames = std::move(frames);
  if (fault.kind != "imu") return;
  ImuBuffer imu;
  for (const ImuSample& sample : tracks->imu.samples()) {
    const double t = secondsBetween(tracks->first_image, sample.t) - fault.at_s;
    if (t < 0.0 || t >= fault.for_s) imu.add(sample);
  }
  tracks->imu = std::move(imu);
}

}  // namespace etalon
