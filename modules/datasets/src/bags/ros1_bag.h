#pragma once

#include <memory>
#include <string>

#include "bags/bag_file.h"

namespace etalon {

/** A ROS 1 bag, read by rosbag_storage. @throws DataError if it cannot be opened */
std::unique_ptr<BagFile> openRos1Bag(const std::string& path);

/** Whether it is a file that begins as a ROS 1 bag does. */
bool isRos1Bag(const std::string& path);

}  // namespace etalon
