#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "etalon/benchmark/record.h"
#include "etalon/evaluation/trajectory_evaluation.h"
#include "etalon/runlog/initialization_json.h"

namespace etalon {

// Where ground truth covers only a few poses of a trajectory or a window, the errors against it
// mean nothing, because a few poses can be aligned with anything. Below a minimum share no errors
// are given.

/** The least number of covered poses, whatever the share: two can always be aligned exactly. */
constexpr size_t kMinCoveredPoses = 3;

/** @param wanted share; fewer than kMinCoveredPoses poses are never enough, unless they are all */
bool coversEnough(size_t covered, size_t total, double wanted);

/** Poses of the trajectory that have ground truth (GroundTruth::at). */
size_t coveredPoses(const Trajectory& trajectory, const GroundTruth& ground_truth);

/**
 * Number of poses of the estimate that are associated, or lie between two associated ones at most a
 * second apart: a reference of a lower rate covers the time between its poses.
 */
size_t coveredPoses(const Trajectory& estimate, const AssociatedTrajectories& associated);

/** Sets the errors of a stage to NaN (unknown) where too few of its keyframes have ground truth. */
void requireCoverage(AttemptRecord* attempt, double wanted);
/** Does the same for the run's attempts and its whole trajectory. */
void requireCoverage(RunRecord* run, double wanted);
/** Does the same for all windows, with the share of the protocol. */
void requireCoverage(BenchmarkRecord* benchmark);

/** Whether enough of the window's keyframes have ground truth, whatever came of it. */
bool coversEnough(const WindowResult& result, const BenchmarkProtocol& protocol);

/** A sentence on how much of a run ground truth covers; empty if it covers everything or there is
 * none. */
std::string describeCoverage(const GroundTruthUse& use, double wanted);

/** The same for a benchmark's windows: a sentence for every recording not covered wholly. */
std::vector<std::string> describeCoverage(const BenchmarkRecord& benchmark);

}  // namespace etalon
