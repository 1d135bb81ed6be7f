#pragma once

#include "etalon/runlog/run_log.h"
#include "etalon/testing/temporary_folder.h"

namespace etalon::testing {

constexpr TimeNs kFirstImage = 1403636584763555584;  // not a multiple of MRPT's tick

/** Every member filled with numbers that differ; one refused attempt, one accepted one. */
RunRecord exampleRecord();

/** What a log of a run borrows. */
struct ExampleRun {
  RunRecord record;
  StereoInertialCalibration calibration;
  std::vector<StereoReference> images;
  std::vector<FrameEstimate> estimates;
  GroundTruth ground_truth;

  RunLog log() const { return {record, calibration, images, estimates, ground_truth}; }
};

/** The record with poses at 20 Hz for half a second, ground truth and references to images. */
ExampleRun exampleRun();

}  // namespace etalon::testing
