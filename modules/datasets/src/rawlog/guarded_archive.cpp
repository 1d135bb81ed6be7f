#include "rawlog/guarded_archive.h"

#include <algorithm>
#include <array>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <stdexcept>
#include <utility>

#include "etalon/core/errors.h"
#include "rawlog/jpeg_check.h"

namespace etalon {

namespace {

/** zlib never packs more into a byte (https://zlib.net/zlib_tech.html). */
constexpr std::int64_t kBestCompression = 1032;
/** The first of MRPT's class CImage that says whether it is a file and how large it is. */
constexpr int kFirstImageVersion = 7;

constexpr std::array<const char*, 5> kKnown = {"CObservationComment", "CObservationStereoImages",
                                               "CObservationIMU", "CObservationRobotPose",
                                               "CSensoryFrame"};

bool startsWith(const std::string& text, const char* start) { return text.rfind(start, 0) == 0; }

template <typename T>
T numberAt(const std::uint8_t* bytes) {
  T value;
  std::memcpy(&value, bytes, sizeof value);
  return value;
}

std::int64_t mostBytesOf(const std::string& path) {
  std::ifstream in(path, std::ios::binary);
  std::array<char, 2> magic{};
  in.read(magic.data(), magic.size());
  const bool compressed = in && magic[0] == '\x1f' && magic[1] == '\x8b';
  std::error_code error;
  const auto size = static_cast<std::int64_t>(std::filesystem::file_size(path, error));
  return error ? 0 : compressed ? kBestCompression * size : size;
}

}  // namespace

GuardedArchive::GuardedArchive(const std::string& path) {
  std::error_code error;
  if (!std::filesystem::is_regular_file(path, error))
    throw DataError(path, 0, "there is no such file; expected an MRPT rawlog");
  if (!stream_.open(path)) throw DataError(path, 0, "cannot be opened; expected an MRPT rawlog");
  most_bytes_ = mostBytesOf(path);
}

void GuardedArchive::startObject() {
  bytes_of_object_ = 0;
  refusal_.clear();
  class_.clear();
  next_ = Next::kOther;
  name_length_ = 0;
  is_known_ = in_frame_ = is_text_ = false;
}

size_t GuardedArchive::write(const void* /*buffer*/, size_t /*count*/) {
  throw std::logic_error("opened for reading");
}

std::string GuardedArchive::getArchiveDescription() const { return stream_.getStreamDescription(); }

size_t GuardedArchive::read(void* buffer, size_t count) {
  const size_t got = stream_.Read(buffer, count);
  if (got > count) return 0;  // zlib's error code
  bytes_of_object_ += got;
  if (got < count) return 0;
  watch(static_cast<const std::uint8_t*>(buffer), count);
  return got;
}

void GuardedArchive::refuse(const std::string& reason) {
  refusal_ = reason;
  throw std::runtime_error(reason);
}

void GuardedArchive::watch(const std::uint8_t* bytes, size_t count) {
  const size_t name_length = std::exchange(name_length_, 0);
  const bool is_text = std::exchange(is_text_, false);
  const Next now = std::exchange(next_, Next::kOther);
  if (now == Next::kJpeg) {
    const std::string problem = problemOfJpeg(bytes, count, width_, height_);
    if (!problem.empty()) refuse(problem);
  } else if (count == 1) {
    const std::uint8_t byte = bytes[0];
    if (now == Next::kVersion) return checkVersion(byte);
    if (now == Next::kExternal) {
      if (byte > 1)
        refuse("whether an image is a file: expected 0 or 1, found " + std::to_string(byte));
      if (byte == 0) next_ = Next::kColor;
    } else if (now == Next::kColor) {
      has_color_ = byte != 0;
      next_ = Next::kWidth;
    } else if ((byte & 0x80) != 0) {  // what a class's name begins with
      name_length_ = byte & 0x7f;
    }
  } else if (count == name_length) {
    // MRPT takes the name for a C string: what stands behind a zero is no part of it.
    const auto* name = reinterpret_cast<const char*>(bytes);
    startClass(std::string(name, strnlen(name, count)), bytes_of_object_ == 1 + count);
  } else if (count == 4 && now == Next::kWidth) {
    width_ = numberAt<std::int32_t>(bytes);
    next_ = Next::kHeight;
  } else if (count == 4 && now == Next::kHeight) {
    height_ = numberAt<std::int32_t>(bytes);
    if (has_color_ && width_ > 0 && height_ > 0)
      next_ = Next::kJpegLength;
    else
      checkArea();
  } else if (count == 4 && (is_known_ || now == Next::kJpegLength) && !is_text) {
    const auto length = numberAt<std::uint32_t>(bytes);
    if (length > most_bytes_)
      refuse("a length of " + std::to_string(length) + ", more than the log can hold");
    if (now == Next::kJpegLength)
      next_ = Next::kJpeg;
    else
      is_text_ = length == 4;
  }
}

void GuardedArchive::startClass(const std::string& name, bool is_first) {
  const size_t colon = name.find_last_of(':');
  class_ = colon == std::string::npos ? name : name.substr(colon + 1);
  const bool is_frame = class_ == "CSensoryFrame";
  const bool carries =
      is_frame || startsWith(class_, "CObservation") || startsWith(class_, "CAction");
  if (is_first && !carries)
    refuse("it is a " + class_ + "; expected an observation, a sensory frame or an action");
  if (is_frame && std::exchange(in_frame_, true)) refuse("a sensory frame inside another");
  if (carries) is_known_ = std::find(kKnown.begin(), kKnown.end(), class_) != kKnown.end();
  next_ = Next::kVersion;
}

void GuardedArchive::checkVersion(std::uint8_t version) {
  if (class_ == "CImage") {
    if (version < kFirstImageVersion)
      refuse("an image of version " + std::to_string(version) + "; expected " +
             std::to_string(kFirstImageVersion) + " or later");
    next_ = Next::kExternal;
  } else if (startsWith(class_, "CMatrix")) {
    has_color_ = false;
    next_ = Next::kWidth;
  }
}

void GuardedArchive::checkArea() {
  const std::int64_t sign = has_color_ ? -1 : 1, channels = has_color_ ? 3 : 1;
  const std::int64_t width = sign * width_, height = sign * height_;
  // Divided, because the product of both and three channels can exceed 64 bits.
  if (width < 0 || height < 0 || (height > 0 && channels * width > most_bytes_ / height))
    refuse("a size of " + std::to_string(width_) + " x " + std::to_string(height_) +
           ", more than the log can hold");
}

}  // namespace etalon
