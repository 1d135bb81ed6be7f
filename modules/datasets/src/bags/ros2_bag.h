#pragma once

#include <memory>
#include <string>

#include "bags/bag_file.h"

namespace etalon {

/**
 * Whether it looks like a ROS 2 bag: a folder with `metadata.yaml`, or a file of sqlite3 or MCAP.
 */
bool isRos2Bag(const std::string& path);

/**
 * A ROS 2 bag in sqlite3 files: its folder, or one file. The tables are those of
 * rosbag2_storage_sqlite3: topics(id, name, type, serialization_format), messages(id, topic_id,
 * timestamp, data).
 * @throws DataError if it cannot be opened, is of another storage (MCAP) or compressed
 */
std::unique_ptr<BagFile> openRos2Bag(const std::string& path);

}  // namespace etalon
