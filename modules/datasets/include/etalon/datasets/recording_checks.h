#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "etalon/datasets/recorded_source.h"

namespace etalon {

/** What looks wrong with a recording, in sentences that name the file and what was expected. */
struct RecordingFindings {
  std::vector<std::string> errors;    ///< with this no result can be right
  std::vector<std::string> warnings;  ///< results may be wrong

  /** Those of `other` after these. */
  void append(const RecordingFindings& other);
};

/** Extrinsics and noise model, against the IMU's samples where they can tell. */
RecordingFindings checkCalibration(const RecordedSource& source);

/** Samples that are no measurements, and units. */
RecordingFindings checkImu(const RecordedSource& source);

/**
 * Looks at a few pairs of images, evenly spread (the first ones where they are embedded in a log):
 * without contrast, left and right the same, left and right exchanged. Pairs that cannot be read
 * are passed over.
 * @param pairs to decode
 */
RecordingFindings checkImages(RecordedSource& source, size_t pairs = 6);

/** Image files that repeat the one before although the gyro turns; nothing of embedded images. */
RecordingFindings checkRepeatedImages(const RecordedSource& source);

/**
 * All of these: what `replay` and `bench` look at before they start. Decodes 6 pairs.
 * @param source is read from: not to be used for a run afterwards (loadFrame)
 */
RecordingFindings checkRecording(RecordedSource& source);

/** Opens the recording once more, and throws a DataError if checkRecording() has errors; else its
 * warnings. */
std::vector<std::string> requireSoundRecording(const std::string& path);

}  // namespace etalon
