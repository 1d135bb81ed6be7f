#include "rawlog/jpeg_check.h"

#include <opencv2/imgcodecs.hpp>
#include <optional>

namespace etalon {

namespace {

/** Of the bytes of the image: a block of 8 x 8 pixels takes two bits or more of a JPEG that is not
 * progressive, and colours may be stored at half the rows and columns. */
constexpr std::int64_t kBestCompression = 512;

struct FrameHeader {
  int width, height, channels;
};

/** The frame header (ITU-T T.81, B.2.2), which stands behind segments that say how long they are. */
std::optional<FrameHeader> frameHeader(const std::uint8_t* bytes, std::size_t size) {
  const auto two = [bytes](std::size_t at) { return 256 * bytes[at] + bytes[at + 1]; };
  for (std::size_t at = 2; at + 10 <= size && bytes[at] == 0xff; at += 2 + two(at + 2)) {
    const int marker = bytes[at + 1];
    const bool is_table = marker == 0xc4 || marker == 0xc8 || marker == 0xcc;
    if (0xc0 <= marker && marker <= 0xcf && !is_table)
      return FrameHeader{two(at + 7), two(at + 5), bytes[at + 9]};
  }
  return std::nullopt;
}

}  // namespace

std::string problemOfJpeg(const std::uint8_t* bytes, std::size_t size, std::int64_t width,
                          std::int64_t height) {
  const std::optional<FrameHeader> header = frameHeader(bytes, size);
  if (!header) return "a JPEG without a header";
  const std::string its = "a JPEG of " + std::to_string(header->width) + " x " +
                          std::to_string(header->height) + " pixels";
  if (header->width != width || header->height != height)
    return its + "; expected " + std::to_string(width) + " x " + std::to_string(height);
  if (header->channels != 3)
    return its + " and " + std::to_string(header->channels) + " channels; expected 3";
  if (3 * width * height > kBestCompression * static_cast<std::int64_t>(size))
    return its + ", more than " + std::to_string(size) + " bytes can hold";
  const cv::Mat encoded(1, static_cast<int>(size), CV_8UC1, const_cast<std::uint8_t*>(bytes));
  if (cv::imdecode(encoded, cv::IMREAD_COLOR).empty()) return its + " that cannot be decoded";
  return "";
}

}  // namespace etalon
