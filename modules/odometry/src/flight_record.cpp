#include "etalon/odometry/flight_record.h"

#include <algorithm>

#include "etalon/core/so3.h"
#include "fixed_lag/bridged_imu.h"

namespace etalon {

namespace {

/** A platform at rest makes no keyframes. One is taken all the same after this many samples (10 s),
 * so that the samples kept between two keyframes stay few. */
constexpr size_t kMostSamples = 2000;

}  // namespace

FlightRecord::FlightRecord(const StereoInertialCalibration& calibration,
                           const FlightRecordOptions& options)
    : calibration_(calibration), options_(options) {}

void FlightRecord::add(TimeNs stamp, const TrackedFrame& frame, const std::vector<ImuSample>& imu,
                       const OdometryOutput& output, const Odometry* odometry) {
  if (!beginning_) {
    const auto& seen = frame.observations;
    const LandmarkId next = landmarks_.empty() ? 0 : landmarks_.rbegin()->first + 1;
    beginning_ = Beginning{stamp, seen.empty() ? next : seen.front().id};
  }
  if (output.previous_keyframe && last_) keepLast();
  // Neighbouring pieces share the sample at the frame between them.
  imu_.insert(imu_.end(), imu.begin() + (imu_.empty() || imu.empty() ? 0 : 1), imu.end());
  imu_missing_ = imu_missing_ || output.imu_missing;
  last_ = Keyframe{stamp, output.state, frame, {}, false, {}};
  if (output.keyframe || imu_.size() > kMostSamples) keepLast();
  noteBlindPiece(stamp, output);
  recall(output.recalled);
  if (!odometry) return;
  for (const StampedPose& pose : odometry->keyframes()) {
    const auto at = std::lower_bound(odometry_times_.begin(), odometry_times_.end(), pose.t);
    if (at != odometry_times_.end() && *at == pose.t)
      smoothed_[at - odometry_times_.begin()].T_WB = pose.T_WB;
  }
  if (!output.keyframe) return;
  for (const auto& [id, p_W] : odometry->landmarks()) landmarks_[id] = p_W;
  while (landmarks_.size() > kMostLandmarks) landmarks_.erase(landmarks_.begin());
}

/** The last frame becomes a keyframe. Where the odometry was lost and begins anew at the same frame,
 * it replaces the one from before, and the samples up to it stay. */
void FlightRecord::keepLast() {
  if (!smoothed_.empty() && smoothed_.back().t == last_->stamp) {
    smoothed_.pop_back();
    odometry_times_.pop_back();
    if (!keyframes_.empty()) {
      imu_ = std::move(keyframes_.back().imu);
      imu_missing_ = keyframes_.back().imu_missing;
      keyframes_.pop_back();
    }
  }
  smoothed_.push_back({last_->stamp, last_->state.T_WB});
  odometry_times_.push_back(last_->frame.t);
  if (options_.max_keyframes > 0) {
    last_->imu = std::move(imu_);
    last_->imu_missing = imu_missing_;
    keyframes_.push_back(*std::move(last_));
  }
  if (keyframes_.size() > options_.max_keyframes) keyframes_.pop_front();
  last_.reset();
  imu_.clear();
  imu_missing_ = false;
}

void FlightRecord::noteBlindPiece(TimeNs stamp, const OdometryOutput& output) {
  const bool seeing = output.unlocated_s == 0.0 || output.used > 0;
  if (seeing && is_blind_ && seen_at_ && output.predicted)
    blind_pieces_.push_back({*seen_at_, stamp, *output.predicted, output.state});
  if (seeing) seen_at_ = stamp;
  is_blind_ = !seeing;
}

Trajectory FlightRecord::smoothedFlight(const Trajectory& causal) const {
  Trajectory bent = causal;
  const auto earlier = [](const StampedPose& pose, TimeNs t) { return pose.t < t; };
  for (const BlindPiece& piece : blind_pieces_) {
    auto pose = std::lower_bound(bent.begin(), bent.end(), piece.from, earlier);
    const auto end = std::lower_bound(pose, bent.end(), piece.to, earlier);
    if (end == bent.end() || end->t != piece.to) continue;
    // The error of the position is v t + a t^2 / 2; it and its derivative are known at the end.
    const NavState &told = piece.predicted, &seen = piece.seen;
    const double T = secondsBetween(piece.from, piece.to);
    const Eigen::Vector3d shift = seen.T_WB.t - told.T_WB.t, change = T * (seen.v_WB - told.v_WB);
    const Eigen::Vector3d turn = logSO3(told.T_WB.R.transpose() * seen.T_WB.R);
    for (; pose != end; ++pose) {
      const double u = secondsBetween(piece.from, pose->t) / T;
      pose->T_WB.R = pose->T_WB.R * expSO3(u * turn);
      pose->T_WB.t += u * (2.0 * shift - change) + u * u * (change - shift);
    }
  }
  return carriedAlong(bent, smoothed_);
}

void FlightRecord::recall(const std::vector<RecalledObservation>& recalled) {
  for (const RecalledObservation& r : recalled) {
    const auto at =
        std::lower_bound(keyframes_.begin(), keyframes_.end(), r.keyframe,
                         [](const Keyframe& keyframe, TimeNs t) { return keyframe.frame.t < t; });
    if (at != keyframes_.end() && at->frame.t == r.keyframe) at->recalled.push_back(r.observation);
  }
}

void FlightRecord::moveWorld(const SE3& T_WW0) {
  if (!beginning_) return;
  for (StampedPose& pose : smoothed_)
    if (pose.t >= beginning_->stamp) pose.T_WB = T_WW0 * pose.T_WB;
  for (Keyframe& keyframe : keyframes_)
    if (keyframe.stamp >= beginning_->stamp) keyframe.state = keyframe.state.moved(T_WW0);
  if (last_) last_->state = last_->state.moved(T_WW0);
  for (BlindPiece& piece : blind_pieces_) {
    if (piece.from < beginning_->stamp) continue;
    piece.predicted = piece.predicted.moved(T_WW0);
    piece.seen = piece.seen.moved(T_WW0);
  }
  for (auto it = landmarks_.lower_bound(beginning_->first_landmark); it != landmarks_.end(); ++it)
    it->second = T_WW0 * it->second;
}

void FlightRecord::interrupt() {
  beginning_.reset();
  imu_.clear();
  imu_missing_ = true;
  last_.reset();
  seen_at_.reset();
}

void FlightRecord::forgetBefore(TimeNs stamp) {
  const auto old = std::find_if(smoothed_.begin(), smoothed_.end(),
                                [stamp](const StampedPose& pose) { return pose.t >= stamp; }) -
                   smoothed_.begin();
  smoothed_.erase(smoothed_.begin(), smoothed_.begin() + old);
  odometry_times_.erase(odometry_times_.begin(), odometry_times_.begin() + old);
  blind_pieces_.erase(std::remove_if(blind_pieces_.begin(), blind_pieces_.end(),
                                     [stamp](const BlindPiece& b) { return b.to < stamp; }),
                      blind_pieces_.end());
}

FinalFlight FlightRecord::finalBa(
    const BiasPriors& priors, const TrajectoryBaOptions& options,
    const std::optional<StereoInertialCalibration>& calibration) const {
  TrajectoryBaProblem problem;
  problem.priors = priors;
  problem.gravity_mps2 = options_.gravity_mps2;
  const Eigen::Vector3d g_W(0.0, 0.0, -options_.gravity_mps2);
  std::vector<const TrackedFrame*> frames;
  std::vector<MoreObservation> recalled;
  const Keyframe* before = nullptr;
  for (const Keyframe& keyframe : keyframes_) {
    for (const Observation& o : keyframe.recalled)
      recalled.push_back({static_cast<int>(frames.size()), &o, options_.sigma_px});
    frames.push_back(&keyframe.frame);
    problem.states.push_back(keyframe.state);
    if (before)
      problem.preintegrations.push_back(
          keyframe.imu_missing
              ? bridgedImu(before->state, before->frame.t, keyframe.frame.t, keyframe.imu,
                           options_.imu_noise, g_W)
              : Preintegration(keyframe.imu, before->state.bias, options_.imu_noise));
    before = &keyframe;
  }
  problem.bundle = BundleProblem(
      buildVisualWindow(calibration.value_or(calibration_), frames, options_.sigma_px, recalled));
  FinalFlight flight;
  flight.ba = solveTrajectoryBa(std::move(problem), options);
  for (size_t k = 0; k < keyframes_.size(); ++k)
    flight.keyframes.push_back({keyframes_[k].stamp, flight.ba.states[k].T_WB});
  return flight;
}

}  // namespace etalon
