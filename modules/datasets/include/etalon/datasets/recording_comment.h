#pragma once

#include <mrpt/obs/CObservationComment.h>

#include <string>
#include <vector>

#include "etalon/datasets/sensor_source.h"

namespace etalon {

// What a rawlog of stock classes cannot hold otherwise, as JSON in two comments: the first, at the
// log's beginning, is meant for people too; the second, at its end, keeps what is lost in the
// observations.

constexpr int kRecordingFormatVersion = 1;
constexpr const char* kRecordingFormat = "etalon recording";
constexpr const char* kIndexFormat = "etalon index";

/** Calibration, noise model and provenance of a log. */
struct RecordingComment {
  StereoInertialCalibration calibration;
  std::string source;  ///< what the log was made from
  std::string source_kind;
  bool images_embedded = false;
  std::string stereo_label, imu_label, ground_truth_label;
};

/** Stamps to the nanosecond and the parts of ground truth that have no place in
 * CObservationRobotPose. */
struct RecordingIndex {
  std::vector<TimeNs> image_stamps, imu_stamps;
  GroundTruth ground_truth;  ///< positions and rotations are not stored here
};

std::string toJson(const RecordingComment& comment);
std::string toJson(const RecordingIndex& index);

/** @param log names the log in messages. @throws DataError for another format, version or a missing
 * key. */
RecordingComment recordingCommentFromJson(const std::string& json, const std::string& log);
RecordingIndex recordingIndexFromJson(const std::string& json, const std::string& log);

/** The value of "format" if the text is a JSON object that begins with this key; else empty. */
std::string formatOfComment(const std::string& text);

/** The text as an observation; `t` places it in the log. */
mrpt::obs::CObservationComment commentObservation(TimeNs t, const std::string& text);

}  // namespace etalon
