#pragma once

#include <map>
#include <string>
#include <vector>

#include "etalon/benchmark/ground_truth_coverage.h"
#include "etalon/pipeline/run_configuration.h"
#include "etalon/runlog/initialization_json.h"
#include "etalon/runlog/run_log.h"

namespace etalon {

/** A run of the pipeline that has come to its end, and what it was made of. Borrows everything. */
struct FinishedRun {
  const SensorSource& source;
  const RunConfiguration& configuration;
  const Pipeline& pipeline;
  const std::vector<StereoReference>& images;   ///< delivered stereo pairs
  double wall_s = 0.0;                          ///< of the whole run
  std::map<std::string, std::string> versions;  ///< of the program and the libraries behind it
  double min_coverage = kMinCoverage;           ///< share with ground truth that errors need
  std::optional<FinalFlight> final_flight;      ///< Pipeline::finalBa(), where it was asked for
  double final_ba_s = 0.0;                      ///< wall time of finalBa()
  std::vector<ImuRateState> imu_states;         ///< Pipeline::onImuState(), where asked for
};

/** The record in initialization.json and run.rawlog, including errors against ground truth. */
RunRecord makeRunRecord(const FinishedRun& run);

/** What writeRunResults() has written, and what it could not write. */
struct RunFiles {
  std::vector<std::string> written;   ///< paths
  std::vector<std::string> failures;  ///< a sentence a file
};

/**
 * Writes trajectory.tum, trajectory_smoothed.tum, states.csv, initialization.json,
 * trajectory.png, report.html, flight.3Dscene, config.ini, run.rawlog and, where there is a final flight or
 * there are states at IMU rate, trajectory_final.tum and states_imu.csv
 * into `folder`, which is made if need be. The files appear together, when all are complete; one
 * that cannot be written, because the disk is full for instance, loses none of the others. Of an
 * earlier run in the folder no file is left.
 * @throws DataError if nothing can be written there
 */
RunFiles writeRunResults(const std::string& folder, const FinishedRun& run,
                         const RunRecord& record);

}  // namespace etalon
