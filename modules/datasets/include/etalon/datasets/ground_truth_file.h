#pragma once

#include <string>

#include "etalon/core/trajectory.h"

namespace etalon {

/** Ground truth from a TUM file, a EuRoC CSV, or a recording that has one.
 * @throws DataError naming the file, and the line where there is one */
GroundTruth readGroundTruth(const std::string& path);

/** Whether `path` holds ground truths of several recordings: a folder that is no recording. */
bool isGroundTruthFolder(const std::string& path);

/**
 * What readGroundTruth() should read for a recording: `path` itself, or where it is a folder of
 * several, the first that is there of NAME.csv, NAME.tum, NAME/data.csv and the recording NAME. An
 * empty path stays empty.
 * @param recording its name
 * @throws DataError if the folder has none of these
 */
std::string groundTruthOf(const std::string& recording, const std::string& path);

}  // namespace etalon
