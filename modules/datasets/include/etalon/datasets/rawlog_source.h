#pragma once

#include <memory>
#include <string>

#include "etalon/datasets/recorded_source.h"

namespace etalon {

/**
 * Opens an MRPT rawlog (gz-compressed or not), object by object.
 *
 * In a log that this project wrote, calibration, noise model and exact stamps come from its
 * comments (see recording_comment.h), and the streams are those that the comment names. In other
 * logs the first sensor label with CObservationStereoImages and the first with CObservationIMU are
 * taken, calibration comes from the observations, and the IMU's noise model is ImuNoiseDensities'
 * default (with a warning). Observations of other labels and classes are ignored. External images
 * are looked for relative to the log's folder; MRPT's process-wide base path is not used.
 *
 * Opening reads through the whole log once, so that a truncated one is found before a run starts.
 *
 * @throws DataError naming the log, the number of the object and what was expected
 */
std::unique_ptr<RecordedSource> openRawlog(const std::string& path,
                                           const SourceOptions& options = {});

}  // namespace etalon
