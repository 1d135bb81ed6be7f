#pragma once

#include <string>
#include <vector>

#include "etalon/core/calibration.h"
#include "etalon/core/tracked_frame.h"
#include "etalon/core/trajectory.h"

namespace etalon {

/** Distribution of errors, px. */
struct ErrorSummary {
  size_t count = 0;
  double median = 0, percentile_68 = 0, percentile_95 = 0;
  double outlier_share = 0;  ///< above 3 px
};
ErrorSummary summarize(const std::vector<double>& errors);

/** Errors of tracks against known poses, by the age of the track (frames since its birth). */
struct AgeRow {
  int first_age = 0, last_age = 0;
  ErrorSummary drift;  ///< left pixel; the landmark lies on the ray of the track's first left pixel
  ErrorSummary left;   ///< left pixel; landmark free, fitted to the whole track
  ErrorSummary right;  ///< right pixel, same landmark
};

struct TrackReport {
  std::vector<AgeRow> ages;
  ErrorSummary drift, left, right;  ///< all ages up to kMaxAge
  double left_sigma = 0;  ///< a coordinate's standard deviation, from the median absolute value
  double right_sigma = 0;
  double median_landmarks = 0, least_landmarks = 0, stereo_share = 0;
  std::vector<double> shared;  ///< with the keyframe kSteps[i] later, share of this one's landmarks
};

/** 2.25 s at 20 Hz: the initialization window. */
constexpr int kMaxAge = 45;
constexpr int kSteps[] = {1, 4, 9};

/**
 * @param frames consecutive frames of a tracker
 * @param T_WB the body's pose at each of them
 * @param keyframes indices into frames
 */
TrackReport judgeTracks(const StereoInertialCalibration& calibration,
                        const std::vector<TrackedFrame>& frames, const std::vector<SE3>& T_WB,
                        const std::vector<int>& keyframes);

/**
 * Poses that fit the tracks better than the recorded ones: landmarks and poses in turn, robust,
 * each pose from the landmarks that it sees. Six numbers a frame cannot hide the errors of hundreds
 * of tracks; what ground truth, time stamps or T_BC have of errors goes into them.
 */
std::vector<SE3> refinePoses(const StereoInertialCalibration& calibration,
                             const std::vector<TrackedFrame>& frames, std::vector<SE3> T_WB,
                             int rounds);

std::string toText(const TrackReport& report);

}  // namespace etalon
