#pragma once

#include <optional>
#include <string>
#include <vector>

#include "etalon/datasets/recording_checks.h"
#include "etalon/datasets/recording_info.h"
#include "etalon/frontend/time_offset.h"

// What looks wrong with a recording, its images decoded and followed.

namespace etalon {

/**
 * Looks at a few pairs of images, evenly spread (the first ones where they are embedded in a log):
 * without contrast, left and right the same, left and right exchanged. Pairs that cannot be read
 * are passed over.
 * @param pairs to decode
 */
RecordingFindings checkImages(RecordedSource& source, size_t pairs = 6);

/**
 * checkCalibration(), checkImu(), checkRepeatedImages() and checkImages(): what `replay` and
 * `bench` look at before they start. Decodes 6 pairs.
 * @param source is read from: not to be used for a run afterwards (loadFrame)
 */
RecordingFindings checkRecording(RecordedSource& source);

/** Opens the recording once more, and throws a DataError if checkRecording() has errors; else its
 * warnings. */
std::vector<std::string> requireSoundRecording(const std::string& path,
                                               const RecordingOptions& options = {});

/** A recording, and how gyro and images agree. */
struct RecordingInspection {
  RecordingInfo info;  ///< with all errors and warnings
  TimeOffsetEstimate time_offset;
  std::optional<double> rotation_disagreement_deg;  ///< see rotationDisagreementDeg()
};

struct InspectionOptions {
  /** Images to decode for the time offset between gyro and camera; 0: no image is decoded. */
  size_t max_frames = 160;
  /** Offsets looked at, s. */
  double max_offset_s = 0.5;
};

/** Opens the recording once more; the warnings of checkMotion(). Decodes as many images as
 * inspectRecording(). */
std::vector<std::string> suspectedByMotion(const std::string& path,
                                           const RecordingOptions& options = {});

/** Describes a recording as a whole (whatever the source's range) and lists what looks wrong with
 * it. */
RecordingInspection inspectRecording(RecordedSource& source, const InspectionOptions& options = {});

}  // namespace etalon
