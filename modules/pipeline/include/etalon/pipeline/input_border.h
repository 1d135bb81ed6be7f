#pragma once

#include <deque>
#include <map>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "etalon/core/calibration.h"
#include "etalon/core/parameters.h"
#include "etalon/datasets/sensor_source.h"
#include "etalon/imu/imu_sample.h"
#include "etalon/imu/saturation.h"

namespace etalon {

/** Section [input]: the limits of what is taken for a measurement. */
struct InputOptions {
  double max_gap_s = 2.0;
  double max_wait_s = 1.0;
  double max_gyro_rps = 100.0;
  double max_accel_mps2 = 1000.0;
  double gyro_range_rps = 0.0;    ///< 0: learnt, SaturationDetector
  double accel_range_mps2 = 0.0;  ///< as above

  void declare(ParameterSet& parameters);
};

/** What was wrong with a measurement. */
enum class InputFault {
  kImuInvalidStamp,     ///< outside of what a stamp can be: dropped
  kImuNotFinite,        ///< dropped
  kImuTooLarge,         ///< beyond max_gyro_rps or max_accel_mps2: dropped
  kImuSaturated,        ///< an axis at the end of its range: used, counting for less there
  kImuRepeatedStamp,    ///< the stamp of the sample before: dropped
  kImuFromThePast,      ///< earlier than the sample before: dropped
  kImuStampAlone,       ///< far ahead, and the next sample is not: dropped
  kImuJump,             ///< a step of more than max_gap_s: nothing is integrated across it
  kImuStepBack,         ///< the clock: what comes is from the past until it has caught up
  kFrameInvalidStamp,   ///< dropped
  kFrameUnusable,       ///< an image is not CV_8UC1 or not of the calibrated size: dropped
  kFrameOfOneCamera,    ///< the other image is missing: used, as if that one's lens were covered
  kFrameRepeatedStamp,  ///< dropped
  kFrameFromThePast,    ///< dropped
  kFrameStampAlone,     ///< dropped
  kFrameJump,           ///< a step of more than max_gap_s: the window of keyframes starts anew
  kFrameStepBack,       ///< as kImuStepBack
  kFrameWithoutImu,     ///< the IMU had not reached it in time: used without IMU
  kFrameRepeatsImage,   ///< its images are those of the frame before, bit for bit, although the
                        ///< platform moved: its pose is a prediction
  kImageRepeated,       ///< so is one image of a frame: used, as if that one's lens were covered
  kFrameLate,           ///< live, the stage ahead was still busy when the next one came: dropped
  kImageUnpaired,       ///< of one camera, without the other's of the same stamp: dropped
  kObservationBroken,   ///< an MRPT observation without what a measurement needs: dropped
};

/** Lower-case name as it stands in files, e.g. "imu_not_finite". */
const char* toString(InputFault fault);
/** Every fault, in the order above. */
const std::vector<InputFault>& inputFaults();

/** How often a fault was seen. */
struct InputFaultCount {
  int count = 0;
  TimeNs first = 0;  ///< stamp of the first measurement that had it
  double value =
      0.0;  ///< of the first one: the rate, the step in seconds...; 0 where there is none
};

using InputFaultCounts = std::map<InputFault, InputFaultCount>;

/** A sentence: what, how often, where first, and what was done. */
std::string describe(InputFault fault, const InputFaultCount& count);

/** The IMU's clock went on elsewhere: nothing can be integrated from what came before. */
struct ClockJump {
  TimeNs from = 0, to = 0;  ///< stamps before and after; to < from: it stepped back
};

/** A measurement that can be used, or the news that the clock jumped. */
using AdmittedInput = std::variant<ImuSample, StereoFrame, ClockJump>;

/**
 * The border between whoever delivers measurements and the estimator behind it. What passes is in
 * order: the stamps of each stream increase strictly (in MRPT's tick of 100 ns, which is what a
 * rawlog can tell apart, frames by 0.1 ms; the stamps themselves are not cut), numbers are finite
 * and plausible, images are as calibrated, a frame comes after the IMU samples up to its stamp.
 * What does not fit is dropped and counted with the reason; nothing throws.
 *
 * A frame waits for the IMU; where frames max_wait_s later are there, or kMaxWaitingFrames, it
 * passes without. Where this happens again and again, frames do not wait until the next sample. A measurement more than max_gap_s ahead is held until the next one of its stream:
 * if that is later still, time went on there (a jump), else the stamp stood alone and is dropped.
 * The first IMU sample is held until the next one, or a frame, is near it; the first frame, which
 * waits for the IMU, is taken back where the next one is long before it.
 *
 * kStepBackRun measurements of a stream in a row that are from the past, and in order, are a clock
 * that stepped back. It is said once; what comes is dropped until the clock has caught up, because
 * poses have the stamps of their measurements and a trajectory is in order.
 */
class InputBorder {
 public:
  static constexpr size_t kMaxWaitingFrames = 100;
  static constexpr int kStepBackRun = 5;
  /** After so many frames in a row without IMU the next ones do not wait for it. */
  static constexpr int kImuIsGone = 5;

  InputBorder(const StereoInertialCalibration& calibration, const InputOptions& options);

  void add(const ImuSample& sample);
  void add(StereoFrame frame);
  /** Lets pass what still waits: there is nothing more to come. */
  void finish();

  /** The next measurement to process; nothing if more has to come first. */
  std::optional<AdmittedInput> next();

  const InputFaultCounts& faults() const { return faults_; }
  /** Counts a fault that only the estimator can see. */
  void count(InputFault fault, TimeNs t, double value = 0.0);

 private:
  template <typename Measurement>
  struct Stream {
    std::optional<TimeNs> last;            ///< stamp of the last one that passed
    std::optional<Measurement> held;       ///< beyond a gap, until the next one comes
    int past = 0;                          ///< measurements from the past in a row, in order
    TimeNs past_first = 0, past_last = 0;  ///< their stamps
    bool stepped_back = false;             ///< since the last one that passed
  };
  /** The shortest step between two stamps, ns, the faults that both streams know, and whether the
   * first measurement is held. */
  struct StreamFaults {
    TimeNs shortest_step;
    InputFault invalid, repeated, past, alone;
    bool first_is_held;
  };

  template <typename Measurement>
  void order(Measurement measurement, Stream<Measurement>* stream, const StreamFaults& faults);
  template <typename Measurement>
  void comeFromThePast(TimeNs t, Stream<Measurement>* stream);
  /** The first IMU sample passes where a frame is near it. */
  void confirmFirstSample();
  /** Whether the last one that passed was the first of its stream, and is forgotten now. */
  bool takeBack(const Stream<ImuSample>& /*imu*/) { return false; }
  bool takeBack(const Stream<StereoFrame>& frames);
  void stepBack(const Stream<ImuSample>& imu);
  void stepBack(const Stream<StereoFrame>& frames);
  void pass(ImuSample sample);
  void pass(StereoFrame frame);
  bool plausible(const ImuSample& sample);
  void release(bool without_imu);

  InputOptions options_;
  std::array<int, 2> widths_{}, heights_{};
  Stream<ImuSample> imu_;
  Stream<StereoFrame> frames_;
  std::optional<TimeNs> first_imu_;
  SaturationDetector saturation_;
  std::deque<StereoFrame> waiting_;  ///< for the IMU
  size_t frames_passed_ = 0;
  int without_imu_ = 0;  ///< frames in a row that waited in vain
  std::deque<AdmittedInput> ready_;
  InputFaultCounts faults_;
};

}  // namespace etalon
