#include "image_file.h"

#include <algorithm>
#include <cerrno>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <opencv2/imgcodecs.hpp>
#include <vector>

namespace etalon {

namespace {

constexpr unsigned char kPngSignature[] = {0x89, 'P', 'N', 'G', '\r', '\n', 0x1a, '\n'};
constexpr size_t kPngHeader = 24;  ///< signature, length and name of IHDR, width, height
constexpr size_t kPngEnd = 64;     ///< the end chunk is looked for in so many last bytes

using Bytes = std::vector<unsigned char>;

bool isPng(const Bytes& start) {
  return start.size() >= sizeof kPngSignature &&
         std::equal(std::begin(kPngSignature), std::end(kPngSignature), start.begin());
}

/** Whether the end of a PNG is missing: decoders would complain on the console about it. */
bool isTruncated(const Bytes& end) {
  static constexpr unsigned char kEndChunk[] = {'I', 'E', 'N', 'D'};
  return std::search(end.end() - std::min(end.size(), kPngEnd), end.end(), std::begin(kEndChunk),
                     std::end(kEndChunk)) == end.end();
}

constexpr const char* kNoFile = "there is no such image file";
constexpr const char* kEmpty = "the image file is empty";
constexpr const char* kTruncated = "the PNG file is truncated (its end chunk is missing)";
constexpr const char* kUndecodable = "the file cannot be decoded; expected a PNG image";

std::string unreadable() {
  return std::string("the image file cannot be read: ") + std::strerror(errno);
}

/** What is wrong with the size; empty if nothing. */
std::string checkSize(std::int64_t width, std::int64_t height, const CameraModel& camera) {
  if (width == camera.width() && height == camera.height()) return {};
  return "expected an image of " + std::to_string(camera.width()) + "x" +
         std::to_string(camera.height()) + " pixels as calibrated, found " + std::to_string(width) +
         "x" + std::to_string(height);
}

/** Four bytes, the greatest first. */
std::int64_t bigEndian(const Bytes& bytes, size_t at) {
  std::int64_t value = 0;
  for (size_t i = at; i < at + 4; ++i) value = 256 * value + bytes[i];
  return value;
}

}  // namespace

cv::Mat decodeGrayImage(const Bytes& bytes, std::string* problem) {
  problem->clear();
  if (bytes.empty()) {
    *problem = kEmpty;
    return {};
  }
  if (isPng(bytes) && isTruncated(bytes)) {
    *problem = kTruncated;
    return {};
  }
  cv::Mat image;
  try {
    image = cv::imdecode(bytes, cv::IMREAD_GRAYSCALE);
  } catch (const cv::Exception& e) {
    image.release();
  }
  if (image.empty()) *problem = kUndecodable;
  return image;
}

cv::Mat readGrayImage(const std::string& path, std::string* problem) {
  problem->clear();
  std::error_code error;
  if (!std::filesystem::is_regular_file(path, error)) {
    *problem = kNoFile;
    return {};
  }
  std::ifstream in(path, std::ios::binary);
  Bytes bytes;
  if (in) {
    const auto size = std::filesystem::file_size(path, error);
    if (!error) bytes.resize(size);
    in.read(reinterpret_cast<char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
  }
  if (!in || error) {
    *problem = unreadable();
    return {};
  }
  return decodeGrayImage(bytes, problem);
}

std::string checkImageFile(const std::string& path, const CameraModel& camera) {
  std::error_code error;
  if (!std::filesystem::is_regular_file(path, error)) return kNoFile;
  const size_t size = std::filesystem::file_size(path, error);
  if (error) return unreadable();
  if (size == 0) return kEmpty;
  std::ifstream in(path, std::ios::binary);
  const auto read = [&in](size_t from, size_t count) {
    Bytes bytes(count);
    in.seekg(static_cast<std::streamoff>(from));
    in.read(reinterpret_cast<char*>(bytes.data()), static_cast<std::streamsize>(count));
    return bytes;
  };
  const Bytes start = read(0, std::min(size, kPngHeader));
  const Bytes end = read(size - std::min(size, kPngEnd), std::min(size, kPngEnd));
  if (!in) return unreadable();
  if (!isPng(start)) return cv::haveImageReader(path) ? std::string() : kUndecodable;
  if (size < kPngHeader || isTruncated(end)) return kTruncated;
  return checkSize(bigEndian(start, 16), bigEndian(start, 20), camera);
}

std::string checkImage(const cv::Mat& image, const CameraModel& camera) {
  if (image.empty()) return "the image is empty";
  if (image.type() != CV_8UC1) return "expected an 8-bit gray image";
  return checkSize(image.cols, image.rows, camera);
}

LoadedFrame loadPair(TimeNs t, const std::string& left, const std::string& right,
                     const StereoInertialCalibration& calibration, bool decode) {
  LoadedFrame result;
  result.frame.t = t;
  result.frame.left_path = left;
  result.frame.right_path = right;
  if (!decode) return result;
  const auto load = [&](const std::string& path, const CameraModel& camera) {
    if (!result.problem.empty()) return cv::Mat();
    cv::Mat image = readGrayImage(path, &result.problem);
    if (result.problem.empty()) result.problem = checkImage(image, camera);
    if (!result.problem.empty()) result.file = path;
    return image;
  };
  result.frame.left = load(left, calibration.cameras[0].model);
  result.frame.right = load(right, calibration.cameras[1].model);
  return result;
}

}  // namespace etalon
