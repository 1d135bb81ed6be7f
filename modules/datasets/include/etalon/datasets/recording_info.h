#pragma once

#include <map>
#include <string>
#include <vector>

#include "etalon/datasets/recorded_source.h"
#include "etalon/datasets/recording_checks.h"

namespace etalon {

/** Stamps of one stream. */
struct StreamSummary {
  struct Gap {
    TimeNs after = 0;     ///< stamp before the gap
    double length_s = 0;  ///< to the next stamp
  };

  size_t count = 0;
  TimeNs first = 0, last = 0;
  double duration_s = 0;
  double rate_hz = 0;  ///< one over the median step
  double longest_step_s = 0;
  std::vector<Gap> gaps;  ///< steps longer than 1.5 median steps
};

/** What there is to know about a recording before it is used. */
struct RecordingInfo {
  std::string name, kind;
  StereoInertialCalibration calibration;
  StreamSummary images, imu, ground_truth;
  bool ground_truth_velocity = false, ground_truth_biases = false;
  int unpaired_left = 0, unpaired_right = 0;
  int missing_images = 0;  ///< pairs whose image files do not exist
  /** Pairs whose files are there but are no images, or not as the calibration says. Embedded
   * images, and faults that only decoding shows, are counted as far as images were decoded. */
  int unusable_images = 0;
  double mean_accel_norm = 0;         ///< m/s^2, if the unit is right
  std::vector<std::string> errors;    ///< sentences: with this no result can be right
  std::vector<std::string> warnings;  ///< sentences

  /** Errors and warnings after those that are there. */
  void append(const RecordingFindings& found);
};

/** By number of the pair: file and what is wrong with it. */
using ImageProblems = std::map<size_t, std::string>;

StreamSummary summarize(const std::vector<TimeNs>& stamps);

/**
 * Describes a recording as a whole (whatever the source's range) and lists what looks wrong with
 * it, as far as streams, calibration and the headers of the images show it.
 * @param decoded what decoding has shown besides
 */
RecordingInfo describeRecording(const RecordedSource& source, const ImageProblems& decoded = {});

}  // namespace etalon
