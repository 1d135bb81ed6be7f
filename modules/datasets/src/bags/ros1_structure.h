#pragma once

#include <string>

namespace etalon {

/**
 * Walks through the records of a ROS 1 bag (http://wiki.ros.org/Bags/Format/2.0) without their data:
 * whether lengths fit into the file, the index names chunks and messages that are there. rosbag_storage
 * believes both. Inside of compressed chunks only the bounds are checked.
 * @throws DataError naming the offset in the file
 */
void checkRos1Structure(const std::string& path);

}  // namespace etalon
