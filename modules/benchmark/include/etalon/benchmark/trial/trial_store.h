#pragma once

#include <functional>
#include <string>
#include <vector>

#include "etalon/benchmark/store.h"
#include "etalon/benchmark/trial/trial_record.h"

namespace etalon {

// The folder of a trial (docs/trial.md):
//   trial.json               everything of TrialRecord but its results
//   runs/<recording>.jsonl   a line a finished run, as they come
//   trajectories/<variant>/  the causal trajectory of every run, TUM
//   config.ini               the effective configurations
//   runs.csv, report.html    written at the end

/** Whether the folder holds a trial, finished or not. */
bool isTrialFolder(const std::string& folder);

/** The trial in a folder; an unfinished one has only the results that are there.
 * @throws DataError naming file, line and what was expected */
TrialRecord readTrial(const std::string& folder);

/** Reads trial.json alone: a record without results. */
TrialRecord readTrialHead(const std::string& folder);

/** Writes trial.json and config.ini. @throws DataError if they cannot be written */
void writeTrialHead(const std::string& folder, const TrialRecord& record);

/** Makes the HTML report of a finished trial, given its folder, which has the trajectories. */
using TrialReport = std::function<std::string(const TrialRecord&, const std::string& folder)>;

/** Writes runs.csv and, if `report` is given, report.html. Returns their paths. */
std::vector<std::string> writeTrialResults(const std::string& folder, const TrialRecord& record,
                                           const TrialReport& report);

/** Whether these files were written: an interrupted trial has none. */
bool hasTrialResults(const std::string& folder);

/** Removes results, so that none of them outlive a trial that starts again. */
void discardTrial(const std::string& folder);

/** A run as its line in runs/, without the line's end. */
std::string resultToText(const TrialRun& run);
/** @throws DataError if the text is no run */
TrialRun trialRunFromText(const std::string& text, const std::string& place = "a run");

/** The file of a run's trajectory: in the trial's folder, or in that of the system. Of a system's
 * run without a fault from the beginning RECORDING.tum will do where there is no other. */
std::string trajectoryPath(const std::string& folder, const TrialRecord& record,
                           const TrialRun& run);

/** The file of the ground truth at the images of a part, without a fault; where there is any. */
std::string groundTruthPath(const std::string& folder, const std::string& recording, double from_s);

/** Puts the results into the order of TrialRecord::results; drops those that the head does not
 * list. */
void sortResults(TrialRecord* record);

/** The runs that are missing for the record to be complete, as resultKey() names them. */
std::vector<std::string> missingResults(const TrialRecord& record);

/** Why the runs of two trials cannot be parts of one. Empty if they do not differ. */
std::string differenceOf(const TrialRecord& a, const TrialRecord& b);

}  // namespace etalon
