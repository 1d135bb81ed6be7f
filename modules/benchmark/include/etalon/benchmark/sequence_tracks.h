#pragma once

#include <atomic>
#include <functional>
#include <string>
#include <vector>

#include "etalon/core/calibration.h"
#include "etalon/core/trajectory.h"
#include "etalon/datasets/recorded_source.h"
#include "etalon/frontend/stereo_tracker.h"
#include "etalon/imu/imu_buffer.h"
#include "etalon/pipeline/pipeline_options.h"

namespace etalon {

/** The front end's tracks of a whole recording, and all else that an initialization needs of it. */
struct SequenceTracks {
  StereoInertialCalibration calibration;
  GroundTruth ground_truth;
  ImuBuffer imu;
  TimeNs first_image = 0;            ///< of the recording, usable or not
  std::vector<TrackedFrame> frames;  ///< of all readable stereo pairs inside the IMU's time
  int unreadable_images = 0;         ///< pairs left out
  double frontend_ms = 0.0;          ///< median time of a frame in the front end, decoding apart
};

struct TrackingOptions {
  StereoTrackerOptions frontend;
  Eigen::Vector3d gyro_bias = Eigen::Vector3d::Zero();  ///< in the predicted rotations, rad/s
  /** Decode the next pair in a second thread while a pair is tracked. The tracks do not change. */
  bool decode_ahead = false;
  /** Called after every pair with the number of pairs done and of all pairs; may be empty. */
  std::function<void(size_t, size_t)> progress;
  /** Ends the work with an Interrupted when it becomes true; may be null. */
  const std::atomic<bool>* stop = nullptr;
};

/** With the pipeline's front end and biases. */
TrackingOptions trackingOptions(const PipelineOptions& pipeline);

/** A recording's own name: its folder's, without "mav0"; its file's, without extension. */
std::string recordingName(const std::string& source);

/** The text with other characters than letters, digits and `._+-` as `_`, for names of files. */
std::string fileName(const std::string& text);

/** @throws ConfigError if two recordings have the same name or would have the same fileName(), a
 * recording given twice for instance */
void requireDifferentNames(const std::vector<std::string>& sources);

/** Everything of the recording but its tracks. What the IMU measured at the end of its range is
 * marked, of a range that is learnt (SaturationDetector). */
SequenceTracks withoutTracks(const RecordedSource& recording);

/**
 * Runs the front end over the recording. A pair that cannot be read is left out and counted; pairs
 * that repeat an image while the platform moves (RepeatedImages) and samples that are no
 * measurements (isMeasurement) are left out, too.
 * @throws DataError if no pair can be used
 */
SequenceTracks trackSequence(RecordedSource& recording, const TrackingOptions& options);

/**
 * The key of a recording's tracks: changes with the recording's content (recordingHash), the
 * options of the front end, and the code of the front end (Etalon's libraries up to it, OpenCV).
 */
std::string tracksKey(const std::string& recording_hash, const TrackingOptions& options);

/**
 * Reads tracks from a cache file (docs/evaluation.md has the format) into frames,
 * unreadable_images and frontend_ms. False, with the reason in *why_not, if the file is not there,
 * has another key or format, or is damaged (its checksum does not fit): then nothing is changed.
 */
bool readTracks(const std::string& path, const std::string& key, SequenceTracks* tracks,
                std::string* why_not);

/**
 * The recording with its tracks: from the cache file `folder`/`name`-KEY.tracks if it can be
 * trusted, else from the front end, which then writes that file. The folder is made if need be.
 * @param recording_hash recordingHash(recording)
 * @param note receives a sentence if there was a file that could not be trusted; may be null
 * @throws like trackSequence() and writeTracks()
 */
SequenceTracks loadOrTrack(RecordedSource& recording, const std::string& recording_hash,
                           const std::string& name, const std::string& folder,
                           const TrackingOptions& options, std::string* note);

/** Writes a cache file; a reader never sees it half written. @throws DataError if it cannot */
void writeTracks(const std::string& path, const std::string& key, const SequenceTracks& tracks);

}  // namespace etalon
