#pragma once

#include <array>
#include <memory>
#include <string>

#include "bags/bag_streams.h"
#include "event_writer.h"

namespace etalon {

const std::array<std::string, 2> kBagImageTopics = {"/cam0/image_raw", "/cam1/image_raw"};
constexpr const char* kBagImuTopic = "/imu0";

/** Writes a bag; messages count as recorded at the instants of their stamps. */
class BagWriter : public EventWriter {
 public:
  using EventWriter::write;
  /** The pose, on kTruthTopic. */
  virtual void write(const StampedState& state) = 0;
  /** After the last message. */
  virtual void close() = 0;
};

// What they throw, if it is not an Error, is the library's.

std::unique_ptr<BagWriter> createRos1Bag(const std::string& path);

/** An sqlite3 file as ROS 2 Humble writes it, which later ones read; close() writes metadata.yaml
 * beside it. */
std::unique_ptr<BagWriter> createRos2Bag(const std::string& path);

}  // namespace etalon
