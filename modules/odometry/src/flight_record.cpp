#include "etalon/odometry/flight_record.h"

#include <algorithm>

#include "etalon/core/so3.h"
#include "fixed_lag/bridged_imu.h"

namespace etalon {

namespace {

/** A platform at rest makes no keyframes. One is taken all the same after this time, so that the
 * samples kept between two keyframes stay few. */
constexpr double kLongestPiece = 10.0;  // s

bool isEarlier(const StampedPose& pose, TimeNs t) { return pose.t < t; }

/** Index of the pose with that stamp. */
std::optional<size_t> poseAt(const Trajectory& trajectory, TimeNs t) {
  const auto pose = std::lower_bound(trajectory.begin(), trajectory.end(), t, isEarlier);
  if (pose == trajectory.end() || pose->t != t) return std::nullopt;
  return pose - trajectory.begin();
}

}  // namespace

FlightRecord::FlightRecord(const StereoInertialCalibration& calibration,
                           const FlightRecordOptions& options)
    : calibration_(calibration), options_(options) {}

void FlightRecord::add(TimeNs stamp, const TrackedFrame& frame, const std::vector<ImuSample>& imu,
                       const OdometryOutput& output, const Odometry* odometry) {
  newest_ = stamp;
  if (!beginning_) beginning_ = Beginning{stamp, firstLandmark(frame)};
  if (output.recognition) moveAfter(*output.recognition);
  if (output.previous_keyframe && last_) keepLast();
  // Neighbouring pieces share the sample at the frame between them.
  imu_.insert(imu_.end(), imu.begin() + (imu_.empty() || imu.empty() ? 0 : 1), imu.end());
  imu_missing_ = imu_missing_ || output.imu_missing;
  last_ = Keyframe{stamp, output.state, frame, {}, false, {}};
  noteBlindPiece(stamp, output);
  const bool is_long =
      !imu_.empty() && secondsBetween(imu_.front().t, imu_.back().t) > kLongestPiece;
  if (output.keyframe || (is_long && !(is_blind_ && output.inertial))) keepLast();
  recall(output.recalled);
  if (!odometry) return;
  for (const StampedPose& pose : odometry->keyframes()) {
    const auto at = std::lower_bound(
        smoothed_.begin(), smoothed_.end(), pose.t,
        [](const SmoothedPose& known, TimeNs t) { return known.odometry_time < t; });
    if (at != smoothed_.end() && at->odometry_time == pose.t) at->T_WB = pose.T_WB;
  }
  if (!output.keyframe) return;
  for (const auto& [id, p_W] : odometry->landmarks()) landmarks_[id] = p_W;
  while (landmarks_.size() > kMostLandmarks) landmarks_.erase(landmarks_.begin());
}

/** The least id that the frame shows, or the next one that there will be. */
LandmarkId FlightRecord::firstLandmark(const TrackedFrame& frame) const {
  if (!frame.observations.empty()) return frame.observations.front().id;
  return landmarks_.empty() ? 0 : landmarks_.rbegin()->first + 1;
}

/** The last frame becomes a keyframe. Where the odometry was lost and begins anew at the same frame,
 * it replaces the one from before, and the samples up to it stay. */
void FlightRecord::keepLast() {
  if (!smoothed_.empty() && smoothed_.back().stamp == last_->stamp) {
    smoothed_.pop_back();
    if (!keyframes_.empty()) {
      imu_ = std::move(keyframes_.back().imu);
      imu_missing_ = keyframes_.back().imu_missing;
      keyframes_.pop_back();
    }
  }
  smoothed_.push_back(
      {last_->stamp, last_->frame.t, firstLandmark(last_->frame), last_->state.T_WB});
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

Trajectory FlightRecord::smoothed() const {
  Trajectory smoothed;
  for (const SmoothedPose& known : smoothed_) smoothed.push_back({known.stamp, known.T_WB});
  return smoothed;
}

Trajectory FlightRecord::smoothedFlight(const Trajectory& causal) const {
  Trajectory smoothed = causal;
  const Trajectory known = this->smoothed();
  for (const Move& move : moves_) {
    // What is between the last keyframe before and the first pose that moves goes a part of the way.
    const auto next = std::lower_bound(known.begin(), known.end(), move.from, isEarlier);
    const TimeNs before = next == known.begin() ? move.from : std::prev(next)->t;
    Trajectory better;
    for (const StampedPose& pose : smoothed)
      if (move.from <= pose.t && pose.t < move.to)
        better.push_back({pose.t, move.T_WW0 * pose.T_WB});
      else if (pose.t == before || pose.t == move.to)
        better.push_back(pose);
    smoothed = carriedAlong(smoothed, better);
  }
  // To where the next image showed the platform at once, and then to where it is known to have been.
  bendBlindPieces(causal, &smoothed);
  smoothed = carriedAlong(smoothed, known);
  bendBlindPieces(causal, &smoothed);
  return smoothed;
}

/** @param smoothed where both ends of a piece are now */
void FlightRecord::bendBlindPieces(const Trajectory& causal, Trajectory* smoothed) const {
  for (const BlindPiece& piece : blind_pieces_) {
    const auto first = poseAt(causal, piece.from), last = poseAt(causal, piece.to);
    if (!first || !last) continue;
    const SE3 at_begin = (*smoothed)[*first].T_WB * causal[*first].T_WB.inverse();
    const SE3 at_end = (*smoothed)[*last].T_WB * piece.seen.T_WB.inverse();
    const NavState predicted = piece.predicted.moved(at_begin), seen = piece.seen.moved(at_end);
    // A cubic: the error of the position and its derivative are zero at the beginning and known at
    // the end. That of a constant acceleration is one, and so is the most likely one of
    // accelerations that are white noise.
    const double T = secondsBetween(piece.from, piece.to);
    const Eigen::Vector3d shift = seen.T_WB.t - predicted.T_WB.t,
                          change = T * (seen.v_WB - predicted.v_WB);
    const Eigen::Vector3d turn = logSO3(predicted.T_WB.R.transpose() * seen.T_WB.R);
    for (size_t k = *first + 1; k < *last; ++k) {
      const double u = secondsBetween(piece.from, causal[k].t) / T;
      SE3& pose = (*smoothed)[k].T_WB;
      pose = at_begin * causal[k].T_WB;
      pose.R = pose.R * expSO3(u * turn);
      pose.t += u * u * ((3.0 - 2.0 * u) * shift + (u - 1.0) * change);
    }
  }
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
  moves_.push_back({beginning_->stamp, newest_, T_WW0});
  moveFrom(*beginning_, T_WW0);
}

/** The odometry has moved its poses since it was blind. */
void FlightRecord::moveAfter(const Recognition& recognition) {
  const auto first =
      std::upper_bound(smoothed_.begin(), smoothed_.end(), recognition.after,
                       [](TimeNs t, const SmoothedPose& known) { return t < known.odometry_time; });
  if (first == smoothed_.end()) return;
  moves_.push_back({first->stamp, newest_, recognition.T_WW0});
  moveFrom({first->stamp, first->first_landmark}, recognition.T_WW0);
}

/** Of what is known of frames; the poses that were told then stay as they were. */
void FlightRecord::moveFrom(const Beginning& beginning, const SE3& T_WW0) {
  for (SmoothedPose& known : smoothed_)
    if (known.stamp >= beginning.stamp) known.T_WB = T_WW0 * known.T_WB;
  for (Keyframe& keyframe : keyframes_)
    if (keyframe.stamp >= beginning.stamp) keyframe.state = keyframe.state.moved(T_WW0);
  if (last_) last_->state = last_->state.moved(T_WW0);
  for (auto it = landmarks_.lower_bound(beginning.first_landmark); it != landmarks_.end(); ++it)
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
  while (!smoothed_.empty() && smoothed_.front().stamp < stamp) smoothed_.pop_front();
  blind_pieces_.erase(std::remove_if(blind_pieces_.begin(), blind_pieces_.end(),
                                     [stamp](const BlindPiece& b) { return b.to < stamp; }),
                      blind_pieces_.end());
  moves_.erase(std::remove_if(moves_.begin(), moves_.end(),
                              [stamp](const Move& move) { return move.to < stamp; }),
               moves_.end());
}

namespace {

/** Across a loss the clock may have jumped by any amount: nothing is known of the motion either way,
 * and the covariance of years cannot be inverted. */
TimeNs bridgedUntil(TimeNs from, TimeNs to) {
  constexpr TimeNs kShortest = kNanosecondsPerSecond / 1000, kLongest = 60 * kNanosecondsPerSecond;
  return from + std::clamp(to - from, kShortest, kLongest);
}

}  // namespace

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
              ? bridgedImu(before->state, before->frame.t,
                           bridgedUntil(before->frame.t, keyframe.frame.t), keyframe.imu,
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
