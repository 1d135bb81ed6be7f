#pragma once

#include <cstddef>
#include <cstdint>

#include "bags/bag_file.h"

namespace etalon {

// Messages of ROS 2, serialized as CDR (OMG's DDS-XTypes, version 1). `path` is the bag's, for
// messages; what does not hold the message is a DataError.

/** The stamp of the header, which is what messages with a header begin with; `size` may end anywhere
 * after it. */
TimeNs cdrStamp(const std::uint8_t* data, size_t size, const std::string& path);

/** Of sensor_msgs/Image, or of sensor_msgs/CompressedImage. */
BagImage cdrImage(const std::uint8_t* data, size_t size, bool compressed, const std::string& path);

/** Of sensor_msgs/Imu. */
ImuSample cdrImu(const std::uint8_t* data, size_t size, const std::string& path);

/** Of geometry_msgs/PoseStamped. */
StampedPose cdrPose(const std::uint8_t* data, size_t size, const std::string& path);

}  // namespace etalon
