#pragma once

#include <mrpt/obs/CObservationStereoImages.h>

#include <optional>
#include <string>
#include <vector>

#include "etalon/datasets/recording_comment.h"

namespace etalon {

/** Where the images of one stereo observation are. */
struct RawlogFrame {
  TimeNs t = 0;
  size_t ordinal = 0;                 ///< among the stereo observations of the label
  std::string left_path, right_path;  ///< empty if embedded
};

/** What one pass through a log collects. */
struct RawlogScan {
  std::optional<RecordingComment> comment;
  std::optional<RecordingIndex> index;
  std::string stereo_label, imu_label;
  std::string ground_truth_label;
  std::vector<RawlogFrame> frames;
  size_t stereo_observations = 0;
  std::vector<ImuSample> imu;  ///< as they come in the log
  std::vector<StampedState> truth;
  std::optional<mrpt::obs::CObservationStereoImages> first_stereo;  ///< without its images
  SE3 T_RB;
  std::vector<TimeNs> without_right;
  size_t incomplete_imu = 0;
  std::vector<std::string> other_labels;
};

/** @throws DataError naming the number of the object and what was expected */
RawlogScan scanRawlog(const std::string& path);

/** The exact stamps, and the rest of the ground truth, where the log's index has them. */
void restoreExact(RawlogScan* scan, GroundTruth* truth);

/** That of the log's comment or of its observations. @throws DataError if it cannot be used */
StereoInertialCalibration calibrationOf(const RawlogScan& scan, const std::string& path,
                                        std::vector<std::string>* warnings);

/** What is worth a warning. */
void describeScan(const RawlogScan& scan, const std::string& path,
                  std::vector<std::string>* warnings);

}  // namespace etalon
