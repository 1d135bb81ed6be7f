#include "image_file.h"

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <opencv2/imgcodecs.hpp>
#include <vector>

namespace etalon {

namespace {

/** Whether the bytes are a PNG whose end is missing: decoders would complain on the console about
 * it. */
bool isTruncatedPng(const std::vector<unsigned char>& bytes) {
  static constexpr unsigned char kSignature[] = {0x89, 'P', 'N', 'G', '\r', '\n', 0x1a, '\n'};
  static constexpr unsigned char kEndChunk[] = {'I', 'E', 'N', 'D'};
  if (bytes.size() < sizeof kSignature ||
      !std::equal(std::begin(kSignature), std::end(kSignature), bytes.begin()))
    return false;
  return std::search(bytes.end() - static_cast<std::ptrdiff_t>(std::min<size_t>(bytes.size(), 64)),
                     bytes.end(), std::begin(kEndChunk), std::end(kEndChunk)) == bytes.end();
}

}  // namespace

cv::Mat readGrayImage(const std::string& path, std::string* problem) {
  problem->clear();
  std::error_code error;
  if (!std::filesystem::is_regular_file(path, error)) {
    *problem = "there is no such image file";
    return {};
  }
  std::ifstream in(path, std::ios::binary);
  std::vector<unsigned char> bytes;
  if (in) {
    const auto size = std::filesystem::file_size(path, error);
    if (!error) bytes.resize(size);
    in.read(reinterpret_cast<char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
  }
  if (!in || error) {
    *problem = std::string("the image file cannot be read: ") + std::strerror(errno);
    return {};
  }
  if (bytes.empty()) {
    *problem = "the image file is empty";
    return {};
  }
  if (isTruncatedPng(bytes)) {
    *problem = "the PNG file is truncated (its end chunk is missing)";
    return {};
  }
  cv::Mat image;
  try {
    image = cv::imdecode(bytes, cv::IMREAD_GRAYSCALE);
  } catch (const cv::Exception& e) {
    image.release();
  }
  if (image.empty()) *problem = "the file cannot be decoded; expected a PNG image";
  return image;
}

std::string checkImage(const cv::Mat& image, const PinholeRadtan& camera) {
  if (image.empty()) return "the image is empty";
  if (image.type() != CV_8UC1) return "expected an 8-bit gray image";
  if (image.cols != camera.width || image.rows != camera.height)
    return "expected an image of " + std::to_string(camera.width) + "x" +
           std::to_string(camera.height) + " pixels as calibrated, found " +
           std::to_string(image.cols) + "x" + std::to_string(image.rows);
  return {};
}

}  // namespace etalon
