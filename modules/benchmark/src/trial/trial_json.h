#pragma once

#include <nlohmann/json.hpp>

#include "etalon/benchmark/trial/trial_record.h"
#include "etalon/runlog/json_reader.h"

namespace etalon {

/** A record without its runs. */
nlohmann::ordered_json trialHeadJson(const TrialRecord& record);
TrialRecord trialHeadFromJson(const JsonReader& json);

nlohmann::ordered_json trialRunJson(const TrialRun& run);
TrialRun trialRunFromJson(const JsonReader& json);

}  // namespace etalon
