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

/** Image files that repeat the one before although the gyro turns; nothing of embedded images. */
RecordingFindings checkRepeatedImages(const RecordedSource& source);

}  // namespace etalon
