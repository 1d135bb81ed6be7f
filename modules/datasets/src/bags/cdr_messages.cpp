#include "bags/cdr_messages.h"

#include <fastcdr/Cdr.h>

#include <array>

#include "bags/bag_poses.h"
#include "etalon/core/errors.h"

namespace etalon {

namespace {

namespace cdr = eprosima::fastcdr;

/** Reads members one after the other. */
class Members {
 public:
  Members(const std::uint8_t* data, size_t size)
      : size_(size),
        // Read only.
        buffer_(reinterpret_cast<char*>(const_cast<std::uint8_t*>(data)), size),
        cdr_(buffer_, cdr::Cdr::DEFAULT_ENDIAN, cdr::Cdr::DDS_CDR) {
    cdr_.read_encapsulation();
  }

  template <typename T>
  T next() {
    T value{};
    cdr_ >> value;
    return value;
  }

  template <size_t N>
  std::array<double, N> numbers() {
    std::array<double, N> values{};
    cdr_ >> values;
    return values;
  }

  Eigen::Vector3d vector() {
    const auto v = numbers<3>();
    return {v[0], v[1], v[2]};
  }

  /** A sequence of bytes, whose length is not believed before it is checked. */
  std::vector<std::uint8_t> bytes() {
    const auto count = next<std::uint32_t>();
    if (count > size_ - cdr_.getSerializedDataLength())
      throw DataError("", 0, "the message ends before its data do");
    std::vector<std::uint8_t> data(count);
    cdr_.deserializeArray(data.data(), data.size());
    return data;
  }

  TimeNs header() {
    const auto seconds = next<std::int32_t>();
    const auto nanoseconds = next<std::uint32_t>();
    next<std::string>();  // frame_id
    return seconds * kNanosecondsPerSecond + nanoseconds;
  }

 private:
  size_t size_;
  cdr::FastBuffer buffer_;
  cdr::Cdr cdr_;
};

template <typename Read>
auto readMembers(const std::uint8_t* data, size_t size, const std::string& path, Read read) {
  try {
    Members members(data, size);
    return read(members);
  } catch (const std::exception& e) {
    throw DataError(path, 0, std::string("expected messages in CDR: ") + e.what());
  }
}

}  // namespace

TimeNs cdrStamp(const std::uint8_t* data, size_t size, const std::string& path) {
  return readMembers(data, size, path, [](Members& members) { return members.header(); });
}

BagImage cdrImage(const std::uint8_t* data, size_t size, bool compressed, const std::string& path) {
  return readMembers(data, size, path, [&](Members& members) {
    BagImage image;
    image.compressed = compressed;
    members.header();
    if (!compressed) {
      image.height = members.next<std::uint32_t>();
      image.width = members.next<std::uint32_t>();
    }
    image.encoding = members.next<std::string>();
    if (!compressed) {
      image.big_endian = members.next<std::uint8_t>() != 0;
      image.step = members.next<std::uint32_t>();
    }
    image.data = members.bytes();
    return image;
  });
}

ImuSample cdrImu(const std::uint8_t* data, size_t size, const std::string& path) {
  return readMembers(data, size, path, [](Members& members) {
    ImuSample sample;
    sample.t = members.header();
    members.numbers<4>();  // orientation
    members.numbers<9>();  // its covariance
    sample.gyro = members.vector();
    members.numbers<9>();
    sample.accel = members.vector();
    members.numbers<9>();
    return sample;
  });
}

StampedPose cdrPose(const std::uint8_t* data, size_t size, const std::string& path) {
  return readMembers(data, size, path, [&](Members& members) {
    StampedPose pose;
    pose.t = members.header();
    const Eigen::Vector3d p = members.vector();
    const auto q = members.numbers<4>();  // x, y, z, w
    pose.T_WB = poseOfMessage(p, {q[3], q[0], q[1], q[2]}, path);
    return pose;
  });
}

}  // namespace etalon
