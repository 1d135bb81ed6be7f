#pragma once

#include <string>
#include <vector>

#include "etalon/benchmark/trial/trial_summary.h"
#include "etalon/report/benchmark_tables.h"

namespace etalon {

/**
 * The tables of a trial. Headlines are the ones for the screen: what each variant is worth; what
 * each fault does; where there are several variants, errors after the start. Then, for the report:
 * survival by recording, differences between variants, every failure.
 */
std::vector<TitledTable> trialTables(const TrialRecord& record);

/**
 * The page that a trial prints: its headlines, the most frequent failures with their reasons, at
 * most `lines` lines of at most 100 characters, what does not fit being counted.
 */
std::string trialPage(const TrialRecord& record, const TextStyle& style, size_t lines = 30);

}  // namespace etalon
