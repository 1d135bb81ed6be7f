#pragma once

#include <string>

#include "etalon/benchmark/calibration/noise_calibration.h"
#include "etalon/report/comparison_table.h"

namespace etalon::app {

/** The columns of a table of calibrations of the noise. */
Table emptyNoiseTable();

/** Adds the iterations of a calibration and its result. */
void addNoiseRows(const std::string& recording, double interval_s,
                  const NoiseCalibration& calibration, Table* table);

/** Says in words how good the noise in use and the estimate are. */
void printNoise(const std::string& recording, const NoiseCalibration& calibration, double overlap);

/** Whether the relative standard error of a factor says that there is little to be believed in. */
bool hardlyDetermined(double relative_sigma);

}  // namespace etalon::app
