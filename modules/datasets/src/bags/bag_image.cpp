#include <opencv2/imgproc.hpp>

#include "bags/bag_file.h"
#include "etalon/core/printable.h"
#include "image_file.h"

namespace etalon {

namespace {

struct Encoding {
  const char* name;  ///< as sensor_msgs/image_encodings.h has it
  int type;          ///< of cv::Mat
  int to_gray;       ///< cv::ColorConversionCodes; -1: it is gray
};

constexpr Encoding kEncodings[] = {
    {"mono8", CV_8UC1, -1},
    {"8UC1", CV_8UC1, -1},
    {"mono16", CV_16UC1, -1},
    {"16UC1", CV_16UC1, -1},
    {"bgr8", CV_8UC3, cv::COLOR_BGR2GRAY},
    {"rgb8", CV_8UC3, cv::COLOR_RGB2GRAY},
    {"bgra8", CV_8UC4, cv::COLOR_BGRA2GRAY},
    {"rgba8", CV_8UC4, cv::COLOR_RGBA2GRAY},
};

const Encoding* findEncoding(const std::string& name) {
  for (const Encoding& encoding : kEncodings)
    if (name == encoding.name) return &encoding;
  return nullptr;
}

cv::Mat decompressed(const BagImage& image, std::string* problem) {
  cv::Mat gray = decodeGrayImage(image.data, problem);
  if (!problem->empty())
    *problem = "the compressed image ('" + printable(image.encoding) + "'): " + *problem;
  return gray;
}

/** The upper eight bits. */
cv::Mat upperBytes(const cv::Mat& image, bool big_endian) {
  cv::Mat halves[2];
  cv::split(cv::Mat(image.rows, image.cols, CV_8UC2, image.data, image.step), halves);
  return halves[big_endian ? 0 : 1];
}

}  // namespace

cv::Mat toGray(const BagImage& image, std::string* problem) {
  problem->clear();
  if (image.compressed) return decompressed(image, problem);
  const Encoding* const encoding = findEncoding(image.encoding);
  if (!encoding) {
    std::string known;
    for (const Encoding& e : kEncodings) known.append(known.empty() ? "" : ", ").append(e.name);
    *problem =
        "the encoding '" + printable(image.encoding) + "' is not read; expected one of " + known;
    return {};
  }
  constexpr std::uint32_t kMostPixels = 1u << 16;  // in a row or a column
  const bool sane = 0 < image.width && image.width < kMostPixels && 0 < image.height &&
                    image.height < kMostPixels;
  if (!sane || image.step < image.width * CV_ELEM_SIZE(encoding->type) ||
      image.data.size() < std::size_t(image.step) * image.height) {
    *problem = "the image holds " + std::to_string(image.data.size()) + " bytes; expected " +
               std::to_string(image.height) + " rows of " + std::to_string(image.width) +
               " pixels, encoding " + image.encoding;
    return {};
  }
  // Read only.
  const cv::Mat raw(int(image.height), int(image.width), encoding->type,
                    const_cast<std::uint8_t*>(image.data.data()), image.step);
  if (raw.depth() == CV_16U) return upperBytes(raw, image.big_endian);
  if (encoding->to_gray < 0) return raw.clone();
  cv::Mat gray;
  cv::cvtColor(raw, gray, encoding->to_gray);
  return gray;
}

}  // namespace etalon
