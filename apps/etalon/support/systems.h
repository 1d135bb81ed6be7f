#pragma once

#include <string>
#include <vector>

#include "etalon/benchmark/trial/trial_record.h"

namespace etalon::app {

/**
 * Systems whose trajectories are TUM files, each named as its file or folder, with as many of the folders that it is in as
 * tell the names apart. Where there is one recording the folder of a run stands for its trajectory.tum.
 * @throws ConfigError if one is given twice
 */
std::vector<NamedText> systemsOf(const std::vector<std::string>& paths, size_t recordings);

}  // namespace etalon::app
