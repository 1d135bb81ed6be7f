#pragma once

#include <string>
#include <vector>

#include "etalon/core/calibration.h"
#include "etalon/core/trajectory.h"
#include "etalon/pipeline/frame_estimate.h"
#include "etalon/runlog/initialization_json.h"

namespace etalon {

/** Name of the log in a run's folder. */
constexpr const char* kRunLogName = "run.rawlog";

/** A stereo pair of the run's input: the files, absolute paths. */
struct StereoReference {
  TimeNs t = 0;
  std::string left_path, right_path;
};

/** What a run's log holds. Borrows everything: a long run has much of it. */
struct RunLog {
  const RunRecord& record;
  const StereoInertialCalibration& calibration;
  const std::vector<StereoReference>& images;   ///< those whose paths are empty are left out
  const std::vector<FrameEstimate>& estimates;  ///< of all frames
  const GroundTruth& ground_truth;              ///< may be empty
};

/**
 * Writes a run as a rawlog of MRPT's stock classes, in time order:
 *  - first a CObservationComment: the record as JSON (see toJson)
 *  - CObservationStereoImages "stereo": the input's images by reference, no pixels, and calibration
 *  - CObservationRobotPose "<initializer>/init" and "<initializer>/vi_ba": the keyframes of the
 *    accepted attempt, else of the last one that has states; "<initializer>/odometry"; and
 *    "ground_truth", inside the run's time
 * A pose has the covariance of its estimate, or zero if it is not known. The observations' stamps
 * are cut to MRPT's tick of 100 ns; those in the record are not.
 * @throws DataError if the log cannot be written
 */
void writeRunLog(const std::string& path, const RunLog& log);

/**
 * The record of a run, from its log.
 * @param run a run's folder, or the log itself
 * @throws DataError if there is no log, or no record in it
 */
RunRecord readRunRecord(const std::string& run);

}  // namespace etalon
