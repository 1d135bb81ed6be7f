#pragma once

#include "etalon/report/trial_tables.h"

namespace etalon {

/** Every other variant of a trial against the first one, by the causal ATE without a fault. */
TitledTable differenceTable(const TrialRecord& record);

}  // namespace etalon
