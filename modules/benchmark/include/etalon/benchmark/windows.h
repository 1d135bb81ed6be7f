#pragma once

#include <optional>
#include <string>
#include <vector>

#include "etalon/benchmark/record.h"
#include "etalon/benchmark/sequence_tracks.h"
#include "etalon/imu/imu_noise.h"
#include "etalon/pipeline/window_initialization.h"

namespace etalon {

/** Every number of keyframes with every rate, in the protocol's order. */
std::vector<WindowShape> shapesOf(const BenchmarkProtocol& protocol);

/** A week. Images further apart mean a damaged stamp, which would give years of empty windows. */
constexpr double kLongestRecordingS = 7 * 86'400.0;

/** @throws DataError if the images of the recording `name` are further apart than that */
void checkLength(const std::string& name, TimeNs first_image, TimeNs last_image);

/** Least time from first to last image for a window, s: half a keyframe interval may be missing. */
double shortestRecording(const WindowShape& shape);

/**
 * Why recordings that could be used have no window, a sentence each: "NAME: too short for N
 * keyframes at R Hz (needs X s, has Y s): 0 windows". Nothing where the record has a window.
 */
std::vector<std::string> tooShort(const BenchmarkRecord& record, const WindowShape& shape);
/** The same over the shapes of the protocol and of the results. */
std::vector<std::string> tooShort(const BenchmarkRecord& record);

/** Images a second: from the median of the intervals. 0 with fewer than two. */
double imageRate(const std::vector<TimeNs>& stamps);

/** @throws ConfigError if a rate is above that of the camera: keyframes are images. */
void checkKeyframeRates(const std::vector<double>& rates_hz, double camera_hz,
                        const std::string& recording);

/**
 * Number of windows of a recording. Window i starts every_s * i after the first image and exists if
 * it ends at the last image or before (see shortestRecording()).
 */
int windowCount(TimeNs first_image, TimeNs last_image, double every_s, const WindowShape& shape);

/**
 * Window number `window` as a problem: keyframes by KeyframeSelector from the first frame of the
 * window on, all frames between them, raw IMU. The result depends on nothing but the arguments.
 * If images are missing up to the end of the recording, the problem has fewer keyframes; if the
 * first keyframe interval has none, it has no keyframe.
 * @param noise derives the densities to use from the data sheet's and the window's samples
 */
InitializationProblem windowProblem(const SequenceTracks& tracks, double every_s,
                                    const WindowShape& shape, int window,
                                    const ImuNoiseOptions& noise, const WindowOptions& options);

}  // namespace etalon
