#pragma once

#include <mrpt/obs/CObservationStereoImages.h>

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "etalon/datasets/recording_comment.h"

namespace etalon {

/** Where the images of one stereo observation are. */
struct RawlogFrame {
  TimeNs t = 0;
  std::string left_path, right_path;  ///< empty if embedded
};

/** The observations of one class, and the label whose observations are read. */
struct RawlogStream {
  /** The comment's; else that of the first observation that can be used. */
  std::optional<std::string> label;
  /** By label, of all that the log has but those that are read: the stamps of those that cannot be
   * used. */
  std::map<std::string, std::vector<TimeNs>> unusable;

  /** Whether this observation is to be read. */
  bool takes(const std::string& observed_label, TimeNs t, bool is_usable);
  /** Of `label`. */
  std::vector<TimeNs> unusableStamps() const;
  /** "; there are others, of 'a', 'b'": where none was read; empty if there is none at all. */
  std::string othersInWords() const;
};

/** What one pass through a log collects. */
struct RawlogScan {
  std::optional<RecordingComment> comment;
  std::optional<RecordingIndex> index;
  RawlogStream stereo;  ///< usable with a right image
  RawlogStream imu;     ///< usable with all rates and accelerations
  std::string ground_truth_label;
  std::vector<RawlogFrame> frames;
  std::vector<ImuSample> imu_samples;  ///< as they come in the log
  std::vector<StampedState> truth;
  std::optional<mrpt::obs::CObservationStereoImages> first_stereo;  ///< without its images
  SE3 T_RB;
};

/** @throws DataError naming the number of the object and what was expected */
RawlogScan scanRawlog(const std::string& path, bool with_truth);

/** The exact stamps, and the rest of the ground truth, where the log's index has them. */
void restoreExact(RawlogScan* scan, GroundTruth* truth);

/** That of the log's comment or of its observations. @throws DataError if it cannot be used */
StereoInertialCalibration calibrationOf(const RawlogScan& scan, const std::string& path,
                                        std::vector<std::string>* warnings);

/** What is worth a warning. */
void describeScan(const RawlogScan& scan, const std::string& path,
                  std::vector<std::string>* warnings);

}  // namespace etalon
