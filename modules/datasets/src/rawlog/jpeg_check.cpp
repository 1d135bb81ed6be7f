#include "rawlog/jpeg_check.h"

#include <opencv2/imgcodecs.hpp>

namespace etalon {

namespace {

/** Of the bytes of the image: a block of 8 x 8 pixels takes two bits or more of a JPEG that is not
 * progressive, and colours may be stored at half the rows and columns. */
constexpr std::int64_t kBestCompression = 512;

/** What the segments of a JPEG say (ITU-T T.81, B.1 and B.2.2). */
struct JpegHeader {
  int width = 0, height = 0, channels = 0;
  std::size_t end = 0;  ///< of the header: where the compressed data begin
};

JpegHeader readHeader(const std::uint8_t* bytes, std::size_t size) {
  const auto two = [bytes](std::size_t at) { return 256 * bytes[at] + bytes[at + 1]; };
  JpegHeader header;
  for (std::size_t at = 2; at + 10 <= size && bytes[at] == 0xff; at += 2 + two(at + 2)) {
    const int marker = bytes[at + 1];
    const bool is_table = marker == 0xc4 || marker == 0xc8 || marker == 0xcc;
    if (0xc0 <= marker && marker <= 0xcf && !is_table)
      header = {two(at + 7), two(at + 5), bytes[at + 9], 0};
    if (marker == 0xda) {
      header.end = at + 2 + two(at + 2);
      break;
    }
  }
  return header;
}

/** Whether nothing but compressed data and the end of the image stand behind the header, as in every
 * JPEG that MRPT writes: one scan, in which a byte of ones is followed by a zero or is a restart. */
bool isOneScan(const std::uint8_t* bytes, std::size_t size, std::size_t begin) {
  if (size < begin + 2 || bytes[size - 2] != 0xff || bytes[size - 1] != 0xd9) return false;
  for (std::size_t at = begin; at + 2 < size; ++at)
    if (bytes[at] == 0xff && bytes[at + 1] != 0 && (bytes[at + 1] & 0xf8) != 0xd0) return false;
  return true;
}

}  // namespace

std::string problemOfJpeg(const std::uint8_t* bytes, std::size_t size, std::int64_t width,
                          std::int64_t height) {
  const JpegHeader header = readHeader(bytes, size);
  if (header.channels == 0 || header.end == 0) return "a JPEG without a header";
  const std::string its = "a JPEG of " + std::to_string(header.width) + " x " +
                          std::to_string(header.height) + " pixels";
  if (header.width != width || header.height != height)
    return its + "; expected " + std::to_string(width) + " x " + std::to_string(height);
  if (header.channels != 3)
    return its + " and " + std::to_string(header.channels) + " channels; expected 3";
  if (3 * width * height > kBestCompression * static_cast<std::int64_t>(size))
    return its + ", more than " + std::to_string(size) + " bytes can hold";
  if (!isOneScan(bytes, size, header.end)) return its + " that does not end as it should";
  const cv::Mat encoded(1, static_cast<int>(size), CV_8UC1, const_cast<std::uint8_t*>(bytes));
  if (cv::imdecode(encoded, cv::IMREAD_COLOR).empty()) return its + " that cannot be decoded";
  return "";
}

}  // namespace etalon
