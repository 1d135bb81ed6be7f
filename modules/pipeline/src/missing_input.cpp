#include "etalon/pipeline/missing_input.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "etalon/core/text.h"

namespace etalon {

namespace {

/** Of so many images that should have come, this many must be missing: one now and then harms
 * nothing. */
constexpr int kImages = 20, kImagesMissing = 2;
/** A camera is blind that has a tenth of the tracks of the other, and that has enough to tell. */
constexpr int kTracks = 20;
constexpr double kShare = 0.1;

const char* const kCameras[] = {"left", "right"};

}  // namespace

void MissingInput::sample(TimeNs t, bool saturated) {
  if (saturated) {
    saturated_.last = t;
    ++saturated_.count;
    new_saturated_ = true;
  }
  const double step_s = secondsBetween(last_sample_.value_or(t), t);
  if (step_s > longest_imu_step_s_) {
    gaps_.last = t;
    ++gaps_.count;
    gaps_.seconds += step_s;
    new_gap_s_ = std::max(new_gap_s_, step_s);
  }
  last_sample_ = t;
}

std::string MissingInput::clockJumped(TimeNs from, TimeNs to) {
  last_sample_.reset();
  clock_jumped_ = true;
  if (to < from)
    return format("the IMU's stamps step back by %.2f s: samples are refused until they catch up",
                  secondsBetween(to, from));
  return format("the IMU's stamps jump by %.2f s: nothing is integrated across it",
                secondsBetween(from, to));
}

std::vector<std::string> MissingInput::frame(const Frame& frame) {
  Said said;
  const double step_s = secondsBetween(last_frame_.value_or(frame.t), frame.t);
  if (frame.tracked) watchImages(frame, &said);
  watchImu(frame, &said);
  if (frame.tracked) watchCameras(*frame.tracked, step_s, &said);
  watchPose(frame, &said);
  endLacks(frame.t, false, &said);
  last_frame_ = frame.t;
  clock_jumped_ = false;
  return said;
}

void MissingInput::watchCameras(const TrackedFrame& tracked, double step_s, Said* said) {
  std::array<int, 2> seen{static_cast<int>(tracked.observations.size()),
                          static_cast<int>(tracked.right_only.size())};
  for (const Observation& o : tracked.observations) seen[1] += o.has_right;
  for (size_t c = 0; c < 2; ++c) {
    if (seen[1 - c] < kTracks || seen[c] > kShare * seen[1 - c]) continue;
    Lack& blind = blind_[c];
    if (!blind.on)
      said->push_back(format("the %s camera sees nothing: the other one carries on", kCameras[c]));
    blind.on = true;
    blind.last = tracked.t;
    blind.seconds += step_s;
  }
}

void MissingInput::watchImu(const Frame& frame, Said* said) {
  if (new_gap_s_ > 0.0 && !gaps_.on) {
    said->push_back(
        format("no IMU sample for %.2f s%s", new_gap_s_,
               frame.located ? ": images bridge the gap" : ", and no image bridges the gap"));
    gaps_.on = true;
  }
  new_gap_s_ = 0.0;
  if (new_saturated_ && !saturated_.on) {
    said->push_back("the IMU is at the end of its range: it counts for less");
    saturated_.on = true;
  }
  new_saturated_ = false;
  if (frame.imu || clock_jumped_) return;
  if (!no_imu_.on) said->push_back("no IMU reaches the images: they carry on alone");
  no_imu_.on = true;
  no_imu_.last = frame.t;
  ++no_imu_.count;
}

void MissingInput::watchPose(const Frame& frame, Said* said) {
  // The other states that images locate nothing in say so themselves.
  if (frame.located || frame.state != PipelineState::kVisual) return;
  if (!unlocated_.on) said->push_back("no image locates the platform: the pose is a guess");
  unlocated_.on = true;
  unlocated_.last = frame.t;
  ++unlocated_.count;
}

void MissingInput::watchImages(const Frame& frame, Said* said) {
  const double step_s = secondsBetween(last_image_.value_or(frame.t), frame.t);
  last_image_ = frame.t;
  if (step_s == 0.0) return;
  constexpr double kMost = 1e6;  // across a jump of the clock
  int away = static_cast<int>(std::lround(std::min(step_s * image_rate_hz_, kMost))) - 1;
  const bool said_by_state = frame.before == PipelineState::kDeadReckoning;
  if (away < 0 || said_by_state || clock_jumped_) away = 0;
  away_.push_back(away);
  const auto slots = [this] {
    return std::accumulate(away_.begin(), away_.end(), static_cast<int>(away_.size()));
  };
  while (away_.size() > 1 && slots() - away_.front() - 1 >= kImages) away_.pop_front();
  if (images_.on) {
    images_since_ += 1 + away;
    images_.count += away;
    if (away > 0) images_.last = frame.t;
    return;
  }
  const int expected = slots(), missing = expected - static_cast<int>(away_.size());
  if (expected < kImages || missing < kImagesMissing) return;
  said->push_back(format("images are missing: %d of the last %d", missing, expected));
  images_ = {true, frame.t, missing, 0.0};
  images_since_ = expected;
}

void MissingInput::endLacks(TimeNs t, bool all, Said* said) {
  const auto isOver = [t, all](const Lack& lack, double after_s) {
    return lack.on && (all || secondsBetween(lack.last, t) >= after_s);
  };
  for (size_t c = 0; c < 2; ++c)
    if (isOver(blind_[c], kAgainS)) {
      said->push_back(format(all ? "the %s camera saw nothing for %.2f s"
                                 : "the %s camera sees again; it saw nothing for %.2f s",
                             kCameras[c], blind_[c].seconds));
      blind_[c] = Lack();
    }
  if (isOver(gaps_, kAgainS)) {
    if (gaps_.count > 1)
      said->push_back(format("the IMU had %d gaps, %.2f s in all", gaps_.count, gaps_.seconds));
    gaps_ = Lack();
  }
  if (isOver(saturated_, kAgainS)) {
    said->push_back(format("%d IMU samples were at the end of the range", saturated_.count));
    saturated_ = Lack();
  }
  if (isOver(no_imu_, kAgainS)) {
    said->push_back(format(all ? "%d images were without IMU" : "the IMU is back after %d images",
                           no_imu_.count));
    no_imu_ = Lack();
  }
  if (isOver(unlocated_, kAgainS)) {
    said->push_back(format("%d images did not locate the platform", unlocated_.count));
    unlocated_ = Lack();
  }
  if (isOver(images_, kImagesAgainS)) {
    said->push_back(format(
        all ? "%d of %d images were missing" : "all images come again; %d of %d were missing",
        images_.count, images_since_));
    images_ = Lack();
    away_.clear();
  }
}

std::vector<std::string> MissingInput::finish() {
  Said said;
  endLacks(0, true, &said);
  return said;
}

}  // namespace etalon
