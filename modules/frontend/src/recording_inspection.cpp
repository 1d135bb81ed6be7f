#include "etalon/frontend/recording_inspection.h"

#include "etalon/core/errors.h"

namespace etalon {

RecordingFindings checkRecording(RecordedSource& source) {
  RecordingFindings findings = checkCalibration(source);
  findings.append(checkImu(source));
  findings.append(checkRepeatedImages(source));
  findings.append(checkImages(source));
  return findings;
}

namespace {

/** The recording as a whole, without its ground truth. */
std::unique_ptr<RecordedSource> openWhole(const std::string& path,
                                          const RecordingOptions& recording) {
  SourceOptions options;
  options.recording = recording;
  options.recording.own_truth = false;
  return openRecording(path, options);
}

TimeOffsetEstimate offsetOf(RecordedSource& source, const InspectionOptions& options,
                            ImageProblems* problems = nullptr) {
  return estimateTimeOffset(measureCameraRotation(source, options.max_frames, problems),
                            source.imuMeasurements(), options.max_offset_s,
                            source.calibration().cameras[0].T_BC.R.transpose());
}

}  // namespace

std::vector<std::string> requireSoundRecording(const std::string& path,
                                               const RecordingOptions& options) {
  const auto source = openWhole(path, options);
  const RecordingFindings findings = checkRecording(*source);
  if (findings.errors.empty()) return findings.warnings;
  std::string text = "no result can be right with this recording: ";
  for (const std::string& error : findings.errors)
    text += (&error == &findings.errors.front() ? "" : "; ") + error;
  throw DataError(path, 0, text);
}

std::vector<std::string> suspectedByMotion(const std::string& path,
                                           const RecordingOptions& recording) {
  const InspectionOptions options;
  const auto source = openWhole(path, recording);
  return checkMotion(offsetOf(*source, options), source->calibration(),
                     describeRecording(*source).images.rate_hz)
      .warnings;
}

RecordingInspection inspectRecording(RecordedSource& source, const InspectionOptions& options) {
  RecordingInspection inspection;
  if (options.max_frames == 0) {
    inspection.info = describeRecording(source);
    inspection.time_offset.reason = "not asked for";
    return inspection;
  }
  ImageProblems problems;
  const LoadedFrame first = source.loadFrame(0);  // what every run begins with
  if (!first.problem.empty()) problems[0] = describe(first);
  TimeOffsetEstimate& offset = inspection.time_offset;
  offset = offsetOf(source, options, &problems);
  RecordingInfo& info = inspection.info;
  info = describeRecording(source, problems);
  info.append(checkImages(*openWhole(source.name(), source.options().recording)));
  info.append(checkMotion(offset, info.calibration, info.images.rate_hz));
  inspection.rotation_disagreement_deg = rotationDisagreementDeg(offset, info.calibration);
  return inspection;
}

}  // namespace etalon
