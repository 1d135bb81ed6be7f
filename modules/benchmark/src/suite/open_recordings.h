#pragma once

#include <memory>
#include <string>
#include <vector>

#include "etalon/benchmark/record.h"
#include "etalon/datasets/recorded_source.h"
#include "etalon/pipeline/run_configuration.h"

namespace etalon {

/**
 * Opens the recordings of a benchmark or trial and describes each in `sequences`. One that cannot
 * be used is null, and its `error` says why.
 * @param ground_truth as in BenchmarkOptions
 * @throws ConfigError if two have the same name
 */
std::vector<std::unique_ptr<RecordedSource>> openRecordings(
    const std::vector<std::string>& sources, const std::string& ground_truth,
    std::vector<BenchmarkSequence>* sequences);

/** Changes with the recording's files (recordingHash()) and with a ground truth in place of its
 * own. @throws DataError if a file cannot be read */
std::string contentOf(const RecordedSource& recording);

/** The initializers as the record of a benchmark or trial has them. */
std::vector<BenchmarkInitializer> initializerRecords(
    const std::vector<ConfiguredInitializer>& initializers);

}  // namespace etalon
