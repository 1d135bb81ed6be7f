#include "etalon/pipeline/input_border.h"

#include <cmath>
#include <utility>

#include "etalon/core/text.h"
#include "etalon/imu/imu_limits.h"

namespace etalon {

namespace {

/** How a fault is named and told: "3 IMU samples dropped: ...". */
struct FaultText {
  InputFault fault;
  const char* name;
  const char* noun;
  const char* what;        ///< after the noun
  const char* value_unit;  ///< of InputFaultCount::value; null where there is none
};

const std::vector<FaultText>& faultTexts() {
  using F = InputFault;
  static const std::vector<FaultText> texts = {
      {F::kImuInvalidStamp, "imu_invalid_stamp", "IMU sample", "dropped: impossible stamp",
       nullptr},
      {F::kImuNotFinite, "imu_not_finite", "IMU sample", "dropped: not a finite number", nullptr},
      {F::kImuTooLarge, "imu_too_large", "IMU sample",
       "dropped: beyond [input] max_gyro_rps or max_accel_mps2", ""},
      {F::kImuSaturated, "imu_saturated", "IMU sample",
       "at the end of the range of an axis: used, with the noise of what it did not show", ""},
      {F::kImuRepeatedStamp, "imu_repeated_stamp", "IMU sample",
       "dropped: the stamp is that of the sample before", nullptr},
      {F::kImuFromThePast, "imu_from_the_past", "IMU sample",
       "dropped: earlier than the sample before", " s"},
      {F::kImuStampAlone, "imu_stamp_alone", "IMU sample",
       "dropped: the stamp is far ahead of those before and after", " s"},
      {F::kImuJump, "imu_jump", "jump",
       "of the IMU's stamps by more than [input] max_gap_s (the clock jumps, or samples are "
       "missing): nothing was integrated across it",
       " s"},
      {F::kImuStepBack, "imu_step_back", "time",
       "the IMU's clock stepped back: its samples were dropped until it had caught up, and nothing "
       "was integrated across it",
       " s"},
      {F::kFrameInvalidStamp, "frame_invalid_stamp", "stereo frame", "dropped: impossible stamp",
       nullptr},
      {F::kFrameUnusable, "frame_unusable", "stereo frame",
       "dropped: an image is not 8-bit gray or not of the calibrated size", nullptr},
      {F::kFrameOfOneCamera, "frame_of_one_camera", "stereo frame",
       "with the image of one camera alone: used", nullptr},
      {F::kFrameRepeatedStamp, "frame_repeated_stamp", "stereo frame",
       "dropped: the stamp is that of the frame before, to 0.1 ms", nullptr},
      {F::kFrameFromThePast, "frame_from_the_past", "stereo frame",
       "dropped: earlier than the frame before", " s"},
      {F::kFrameStampAlone, "frame_stamp_alone", "stereo frame",
       "dropped: the stamp is far ahead of those before and after", " s"},
      {F::kFrameJump, "frame_jump", "jump",
       "of the frames' stamps by more than [input] max_gap_s (the clock jumps, or images are "
       "missing): the motion across it was not seen",
       " s"},
      {F::kFrameStepBack, "frame_step_back", "time",
       "the clock of the frames stepped back: they were dropped until it had caught up", " s"},
      {F::kFrameWithoutImu, "frame_without_imu", "stereo frame",
       "used without IMU: no sample reached the stamp in time", nullptr},
      {F::kFrameRepeatsImage, "frame_repeats_image", "stereo frame",
       "with the images of the frame before, bit for bit, although the platform moved: the pose is "
       "a prediction",
       nullptr},
      {F::kImageRepeated, "image_repeated", "stereo frame",
       "of which one image is that of the frame before, bit for bit, although the platform moved: "
       "the other one was used",
       nullptr},
      {F::kFrameLate, "frame_late", "stereo frame",
       "dropped: front end or estimator were still busy when the next one came", nullptr},
      {F::kImageUnpaired, "image_unpaired", "image",
       "dropped: the other camera has none of the same stamp", nullptr},
      {F::kObservationBroken, "observation_broken", "observation",
       "dropped: rates, accelerations or an image are missing, or cannot be read", nullptr},
  };
  return texts;
}

const FaultText& textOf(InputFault fault) { return faultTexts()[static_cast<size_t>(fault)]; }

/** Sums and differences of two such stamps stay inside TimeNs. */
bool isPossible(TimeNs t) { return -kLastStamp <= t && t <= kLastStamp; }

/** Whether a rawlog cannot tell two stamps apart. */
bool inOneTick(TimeNs a, TimeNs b) { return truncateToMrptTick(a) == truncateToMrptTick(b); }

/** No camera takes 10,000 images a second. Two that are closer than this are one image; the
 * velocity between them would be noise divided by almost nothing. */
constexpr TimeNs kShortestFrameStep = 100'000;

}  // namespace

void InputOptions::declare(ParameterSet& parameters) {
  parameters.add("max_gap_s", &max_gap_s, {0.01, 1e6},
                 "A longer step between two stamps of a stream is a jump: nothing is integrated "
                 "across it, and a window of keyframes starts anew, s.");
  parameters.add("max_wait_s", &max_wait_s, {0.0, 1e3},
                 "A frame waits for the IMU to reach its stamp until there are frames this much "
                 "later; then it is used without IMU, s.");
  parameters.add("max_gyro_rps", &max_gyro_rps, {0.1, 1e6},
                 "IMU samples with a larger rate are dropped, rad/s.");
  parameters.add("max_accel_mps2", &max_accel_mps2, {0.1, 1e6},
                 "IMU samples with a larger specific force are dropped, m/s^2.");
  parameters.add("gyro_range_rps", &gyro_range_rps, {0.0, 1e6},
                 "End of the gyro's range: a sample there shows less than the truth, rad/s; 0: the "
                 "largest value, where it comes four times in a row or six times in all.");
  parameters.add("accel_range_mps2", &accel_range_mps2, {0.0, 1e6},
                 "The same of the accelerometer, m/s^2.");
}

const char* toString(InputFault fault) { return textOf(fault).name; }

const std::vector<InputFault>& inputFaults() {
  static const std::vector<InputFault> faults = [] {
    std::vector<InputFault> all;
    for (const FaultText& text : faultTexts()) all.push_back(text.fault);
    return all;
  }();
  return faults;
}

std::string describe(InputFault fault, const InputFaultCount& count) {
  const FaultText& text = textOf(fault);
  const std::string value =
      text.value_unit ? format(": %.4g%s", count.value, text.value_unit) : std::string();
  return "input: " + std::to_string(count.count) + " " + text.noun + (count.count == 1 ? "" : "s") +
         " " + text.what + " (the first at stamp " + std::to_string(count.first) + value + ")";
}

InputBorder::InputBorder(const StereoInertialCalibration& calibration, const InputOptions& options)
    : options_(options), saturation_(options.gyro_range_rps, options.accel_range_mps2) {
  for (size_t c = 0; c < 2; ++c) {
    widths_[c] = calibration.cameras[c].model.width();
    heights_[c] = calibration.cameras[c].model.height();
  }
}

void InputBorder::count(InputFault fault, TimeNs t, double value) {
  InputFaultCount& c = faults_[fault];
  if (c.count++ == 0) c.first = t, c.value = value;
}

bool InputBorder::plausible(const ImuSample& sample) {
  if (!sample.gyro.allFinite() || !sample.accel.allFinite()) {
    count(InputFault::kImuNotFinite, sample.t);
    return false;
  }
  if (isMeasurement(sample, options_.max_gyro_rps, options_.max_accel_mps2)) return true;
  const double gyro = sample.gyro.cwiseAbs().maxCoeff();
  const double accel = sample.accel.cwiseAbs().maxCoeff();
  count(InputFault::kImuTooLarge, sample.t, gyro > options_.max_gyro_rps ? gyro : accel);
  return false;
}

void InputBorder::add(const ImuSample& sample) {
  if (!plausible(sample)) return;
  order(sample, &imu_,
        {kMrptTickNs, InputFault::kImuInvalidStamp, InputFault::kImuRepeatedStamp,
         InputFault::kImuFromThePast, InputFault::kImuStampAlone, true});
  confirmFirstSample();
}

void InputBorder::add(StereoFrame frame) {
  cv::Mat* const images[] = {&frame.left, &frame.right};
  for (size_t c = 0; c < 2; ++c)
    if (images[c]->empty() && !images[1 - c]->empty()) {
      *images[c] = cv::Mat::zeros(heights_[c], widths_[c], CV_8UC1);
      count(InputFault::kFrameOfOneCamera, frame.t);
    }
  for (size_t c = 0; c < 2; ++c)
    if (images[c]->type() != CV_8UC1 || images[c]->cols != widths_[c] ||
        images[c]->rows != heights_[c])
      return count(InputFault::kFrameUnusable, frame.t);
  order(std::move(frame), &frames_,
        {kShortestFrameStep, InputFault::kFrameInvalidStamp, InputFault::kFrameRepeatedStamp,
         InputFault::kFrameFromThePast, InputFault::kFrameStampAlone, false});
  confirmFirstSample();
}

template <typename Measurement>
void InputBorder::order(Measurement measurement, Stream<Measurement>* stream,
                        const StreamFaults& faults) {
  const TimeNs t = measurement.t;
  if (!isPossible(t)) return count(faults.invalid, t);
  if (stream->held) {
    const TimeNs held = stream->held->t;
    if (inOneTick(t, held) || (t > held && t - held < faults.shortest_step))
      return count(faults.repeated, t);
    const bool is_first = !stream->last;
    if (t > held || (is_first && secondsBetween(t, held) <= options_.max_gap_s)) {
      pass(std::move(*stream->held));
      stream->last = held;
    } else {
      count(faults.alone, held, secondsBetween(stream->last.value_or(t), held));
    }
    stream->held.reset();
  }
  if (!stream->last && faults.first_is_held) {
    stream->held = std::move(measurement);
    return;
  }
  if (stream->last && secondsBetween(t, *stream->last) > options_.max_gap_s && takeBack(*stream)) {
    count(faults.alone, *stream->last, secondsBetween(t, *stream->last));
    stream->last.reset();
  }
  if (stream->last) {
    const double step_s = secondsBetween(*stream->last, t);
    if (inOneTick(t, *stream->last) ||
        (t > *stream->last && t - *stream->last < faults.shortest_step))
      return count(faults.repeated, t);
    if (step_s < 0.0) {
      count(faults.past, t, step_s);
      return comeFromThePast(t, stream);
    }
    stream->past = 0;
    if (step_s > options_.max_gap_s) {
      stream->held = std::move(measurement);
      return;
    }
  }
  pass(std::move(measurement));
  stream->last = t;
  stream->stepped_back = false;
}

template <typename Measurement>
void InputBorder::comeFromThePast(TimeNs t, Stream<Measurement>* stream) {
  if (stream->past == 0 || t <= stream->past_last) {
    stream->past = 0;
    stream->past_first = t;
  }
  stream->past_last = t;
  if (++stream->past < kStepBackRun || stream->stepped_back) return;
  stream->stepped_back = true;
  stepBack(*stream);
}

void InputBorder::confirmFirstSample() {
  if (!imu_.held || imu_.last || waiting_.empty()) return;
  const ImuSample held = *imu_.held;
  if (std::abs(secondsBetween(held.t, waiting_.back().t)) > options_.max_gap_s) return;
  imu_.held.reset();
  imu_.last = held.t;
  pass(held);
}

bool InputBorder::takeBack(const Stream<StereoFrame>& frames) {
  const bool waits_alone = frames_passed_ == 1 && waiting_.size() == 1;
  if (!waits_alone || waiting_.front().t != *frames.last) return false;
  waiting_.clear();
  frames_passed_ = 0;
  return true;
}

void InputBorder::stepBack(const Stream<ImuSample>& imu) {
  while (!waiting_.empty()) release(true);  // what comes is of later
  count(InputFault::kImuStepBack, imu.past_first, secondsBetween(imu.past_first, *imu.last));
  ready_.emplace_back(ClockJump{*imu.last, imu.past_first});
  first_imu_.reset();
}

void InputBorder::stepBack(const Stream<StereoFrame>& frames) {
  count(InputFault::kFrameStepBack, frames.past_first,
        secondsBetween(frames.past_first, *frames.last));
}

void InputBorder::pass(ImuSample sample) {
  if (!first_imu_) first_imu_ = sample.t;
  if (imu_.last && secondsBetween(*imu_.last, sample.t) > options_.max_gap_s) {
    // What still waits from before the jump would wait for ever.
    while (!waiting_.empty() && waiting_.front().t < sample.t) release(true);
    count(InputFault::kImuJump, sample.t, secondsBetween(*imu_.last, sample.t));
    ready_.emplace_back(ClockJump{*imu_.last, sample.t});
    first_imu_ = sample.t;
  }
  if (saturation_.mark(&sample)) {
    const bool gyro = sample.saturated % saturatedAccel(0) != 0;
    count(InputFault::kImuSaturated, sample.t,
          (gyro ? sample.gyro : sample.accel).cwiseAbs().maxCoeff());
  }
  without_imu_ = 0;
  ready_.emplace_back(sample);
  while (!waiting_.empty() && waiting_.front().t <= sample.t) release(false);
}

void InputBorder::pass(StereoFrame frame) {
  if (frames_.last && secondsBetween(*frames_.last, frame.t) > options_.max_gap_s)
    count(InputFault::kFrameJump, frame.t, secondsBetween(*frames_.last, frame.t));
  waiting_.push_back(std::move(frame));
  ++frames_passed_;
  while (!waiting_.empty() && imu_.last && waiting_.front().t <= *imu_.last) release(false);
  while (!waiting_.empty() &&
         (waiting_.size() > kMaxWaitingFrames || without_imu_ >= kImuIsGone ||
          secondsBetween(waiting_.front().t, waiting_.back().t) > options_.max_wait_s))
    release(true);
}

void InputBorder::release(bool without_imu) {
  StereoFrame frame = std::move(waiting_.front());
  waiting_.pop_front();
  without_imu_ = without_imu ? without_imu_ + 1 : 0;
  if (without_imu || !first_imu_ || frame.t < *first_imu_)
    count(InputFault::kFrameWithoutImu, frame.t);
  ready_.emplace_back(std::move(frame));
}

void InputBorder::finish() {
  if (imu_.held) {
    const ImuSample held = *imu_.held;
    imu_.held.reset();
    pass(held);
    imu_.last = held.t;
  }
  if (frames_.held) {
    StereoFrame held = std::move(*frames_.held);
    frames_.held.reset();
    const TimeNs t = held.t;
    pass(std::move(held));
    frames_.last = t;
  }
  while (!waiting_.empty()) release(true);
}

std::optional<AdmittedInput> InputBorder::next() {
  if (ready_.empty()) return std::nullopt;
  AdmittedInput input = std::move(ready_.front());
  ready_.pop_front();
  return input;
}

}  // namespace etalon
