#pragma once

#include <array>
#include <deque>
#include <optional>
#include <string>
#include <vector>

#include "etalon/core/calibration.h"
#include "etalon/core/tracked_frame.h"
#include "etalon/imu/imu_limits.h"
#include "etalon/pipeline/pipeline_state.h"

namespace etalon {

/**
 * Notices what the input lacks although the pipeline goes on in its state: images, IMU samples, one
 * of the two cameras, anything to be seen before the start. A lack is said when it begins, once
 * however long it lasts, and when it has been over for a while, with how much was missing.
 */
class MissingInput {
 public:
  /** A camera, or the IMU, is whole again after this long, s. */
  static constexpr double kAgainS = 1.0;
  /** So are the images: where one of ten is lost at random, 100 in a row hardly ever come. */
  static constexpr double kImagesAgainS = 5.0;

  /** A frame, as front end and pipeline know it. */
  struct Frame {
    TimeNs t = 0;
    const TrackedFrame* tracked = nullptr;  ///< null: it repeats the one before, as if it were none
    bool imu = true;                        ///< the IMU reaches from the frame before to this one
    bool located = true;                    ///< images say where the platform is
    PipelineState before = PipelineState::kInertial;  ///< when the frame came
    PipelineState state = PipelineState::kInertial;   ///< with it
  };

  /** @param calibration with the rates of cam0 and of the IMU (longestImuStep()) */
  explicit MissingInput(const StereoInertialCalibration& calibration)
      : image_rate_hz_(calibration.cameras[0].rate_hz),
        longest_imu_step_s_(longestImuStep(calibration.imu.rate_hz)) {}

  /** An IMU sample, in time order. */
  void sample(TimeNs t, bool saturated = false);
  /** Between these stamps nothing is missing (ClockJump). @return what is to be said of it */
  std::string clockJumped(TimeNs from, TimeNs to);
  /** @return what is to be said of it: clauses; most often none */
  std::vector<std::string> frame(const Frame& frame);
  /** @return what was missing to the end */
  std::vector<std::string> finish();

 private:
  /** Something that is missing. */
  struct Lack {
    bool on = false;
    TimeNs last = 0;       ///< when it was seen last
    int count = 0;         ///< gaps, frames or images since it began
    double seconds = 0.0;  ///< their time
  };
  using Said = std::vector<std::string>;

  void watchCameras(const TrackedFrame& tracked, double step_s, Said* said);
  void watchImu(const Frame& frame, Said* said);
  void watchImages(const Frame& frame, Said* said);
  void watchPose(const Frame& frame, Said* said);
  /** Ends what is over by `t`, or everything. */
  void endLacks(TimeNs t, bool all, Said* said);

  double image_rate_hz_, longest_imu_step_s_;
  std::optional<TimeNs> last_frame_, last_image_,
      last_sample_;            ///< image: of a frame with a new one
  std::array<Lack, 2> blind_;  ///< by camera
  Lack gaps_, saturated_, no_imu_, images_, unlocated_;
  bool clock_jumped_ = false;   ///< since the last frame
  bool new_saturated_ = false;  ///< since the last frame
  double new_gap_s_ = 0.0;      ///< since the last frame; 0: none
  std::deque<int> away_;        ///< images that were missing before the last frames
  int images_since_ = 0;        ///< that should have come since images_ began
};

}  // namespace etalon
