#pragma once

#include <string>
#include <vector>

#include "bags/bag_file.h"
#include "etalon/datasets/sensor_source.h"

namespace etalon {

/** Which topic is what; the ground truth's is empty where there is none. */
struct BagStreams {
  std::string left, right, imu, truth;
};

/** The topics that Kalibr's files name; empty where they do not. */
struct KalibrTopics {
  std::string left, right, imu;
};

/** The topic of a ground truth that is taken without being asked for: of bags that this project
 * wrote. */
constexpr const char* kTruthTopic = "/ground_truth";

/**
 * Takes the topics of the options, else those of Kalibr's files that the bag has, else the only two
 * topics of images (raw ones, or if there are none, compressed ones; the first by name is the left
 * one) and the only one of an IMU.
 * @param path for the message @throws DataError that lists the bag's topics
 */
BagStreams chooseStreams(const std::vector<BagTopic>& topics, const RecordingOptions& options,
                         const KalibrTopics& kalibr, const std::string& path);

}  // namespace etalon
