#pragma once

#include <string>
#include <vector>

#include "etalon/benchmark/trial/trial_record.h"

namespace etalon {

/**
 * A trial of trajectories alone: nothing flies, the TUM files of some systems are judged as a trial
 * judges them. A system is a folder of files RECORDING.tum or RECORDING-FROM-FAULT.tum
 * (trajectoryName()), or one such file, which may have any name if there is but one recording. Where a
 * run's initialization.json lies beside that one (etalon replay) it is of the part that was flown.
 * Such a file has no run of the other parts.
 *
 * Poses are held against the recording's images: of a whole recording all of them, of a part those
 * from FROM to the last pose that any of the systems has there. So a system that starts late or ends
 * early has less coverage. Of faults the names are known alone: images that a fault took away count.
 * @param systems names, each with its folder or file
 * @throws ConfigError, naming it, for a system without a file of these recordings, or with
 * the name of another, and for two recordings of the same name
 * @throws DataError for recordings and files that cannot be read
 */
TrialRecord trialOfTrajectories(const std::vector<NamedText>& systems,
                                const std::vector<std::string>& recordings,
                                const TrialProtocol& protocol);

}  // namespace etalon
