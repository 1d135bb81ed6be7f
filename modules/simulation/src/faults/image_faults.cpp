#include "image_faults.h"

#include <cmath>
#include <opencv2/imgproc.hpp>

#include "etalon/core/angles.h"
#include "fault_list.h"

namespace etalon {

namespace {

/** Noise of 0 to 3 grey levels, all equally likely. */
cv::Mat coveredImage(const cv::Size& size, Random random) {
  cv::Mat image(size, CV_8UC1);
  constexpr size_t kPixelsPerDraw = 32;  // of two bits each
  for (size_t begin = 0; begin < image.total(); begin += kPixelsPerDraw) {
    std::uint64_t bits = random.bits();
    const size_t end = std::min(begin + kPixelsPerDraw, image.total());
    for (size_t i = begin; i < end; ++i, bits >>= 2) image.data[i] = bits & 3;
  }
  return image;
}

cv::Mat gaussianBlurred(const cv::Mat& image, double sigma_px) {
  cv::Mat result;
  cv::GaussianBlur(image, result, cv::Size(), sigma_px, 0.0, cv::BORDER_REPLICATE);
  return result;
}

/** The mean along a line: samples a tenth of a pixel apart, spread over the four pixels around. */
cv::Mat motionBlurred(const cv::Mat& image, double length_px, double direction_deg) {
  const int radius = static_cast<int>(std::ceil(0.5 * length_px)) + 1;
  cv::Mat kernel = cv::Mat::zeros(2 * radius + 1, 2 * radius + 1, CV_32FC1);
  const int samples = 2 * static_cast<int>(std::ceil(5.0 * length_px)) + 1;
  const double angle = radians(direction_deg);
  for (int i = 0; i < samples; ++i) {
    const double along = length_px * (static_cast<double>(i) / samples + 0.5 / samples - 0.5);
    const double x = radius + along * std::cos(angle), y = radius + along * std::sin(angle);
    const int u = static_cast<int>(std::floor(x)), v = static_cast<int>(std::floor(y));
    for (const int du : {0, 1})
      for (const int dv : {0, 1})
        kernel.at<float>(v + dv, u + du) += static_cast<float>(
            (1.0 - std::abs(x - u - du)) * (1.0 - std::abs(y - v - dv)) / samples);
  }
  cv::Mat result;
  cv::filter2D(image, result, CV_8U, kernel, cv::Point(-1, -1), 0.0, cv::BORDER_REPLICATE);
  return result;
}

cv::Mat noisy(const cv::Mat& image, double sigma_gray, Random random) {
  cv::Mat result(image.size(), CV_8UC1);
  const std::uint64_t key = random.bits() << 20;  // 2^20 pixels without a repetition
  const float sigma = static_cast<float>(sigma_gray);
  for (int y = 0; y < image.rows; ++y) {
    const std::uint8_t* const from = image.ptr(y);
    std::uint8_t* const to = result.ptr(y);
    const std::uint64_t row = key + static_cast<std::uint64_t>(y) * image.cols;
    for (int x = 0; x < image.cols; ++x)
      to[x] = cv::saturate_cast<std::uint8_t>(static_cast<float>(from[x]) +
                                              sigma * nearlyNormal(row + x));
  }
  return result;
}

/** One image of a pair. */
class LensFaults {
 public:
  LensFaults(const std::vector<Fault>& faults, double s, std::uint64_t seed, size_t index,
             Lens lens)
      : faults_(faults),
        s_(s),
        seed_(seed),
        item_(2 * index + (lens == Lens::kRight)),
        lens_(lens) {}

  void apply(cv::Mat* image, std::string* path) {
    if (image->empty()) return;
    const uchar* const before = image->data;
    bool covered = false;
    each<faults::Covered>([&](const faults::Covered&, size_t i) {
      *image = coveredImage(image->size(), faultRandom(seed_, i, item_));
      covered = true;
    });
    if (!covered) degrade(image);
    if (image->data != before) path->clear();
  }

 private:
  template <typename T, typename Act>
  void each(Act act) {
    forEachFaultAt<T>(faults_, s_, [&](const T& fault, size_t i) {
      if (fault.lens == Lens::kBoth || fault.lens == lens_) act(fault, i);
    });
  }

  void degrade(cv::Mat* image) {
    each<faults::Blur>([&](const faults::Blur& fault, size_t) {
      if (fault.sigma_px > 0.0) *image = gaussianBlurred(*image, fault.sigma_px);
    });
    each<faults::MotionBlur>([&](const faults::MotionBlur& fault, size_t) {
      if (fault.length_px > 0.0)
        *image = motionBlurred(*image, fault.length_px, fault.direction_deg);
    });
    each<faults::Exposure>([&](const faults::Exposure& fault, size_t) {
      cv::Mat exposed;
      image->convertTo(exposed, CV_8U, fault.factor, fault.offset);
      *image = exposed;
    });
    each<faults::ImageNoise>([&](const faults::ImageNoise& fault, size_t i) {
      *image = noisy(*image, fault.sigma_gray, faultRandom(seed_, i, item_));
    });
  }

  const std::vector<Fault>& faults_;
  double s_;
  std::uint64_t seed_;
  size_t item_;
  Lens lens_;
};

}  // namespace

void applyImageFaults(const std::vector<Fault>& faults, double s, std::uint64_t seed, size_t index,
                      StereoFrame* frame) {
  LensFaults(faults, s, seed, index, Lens::kLeft).apply(&frame->left, &frame->left_path);
  LensFaults(faults, s, seed, index, Lens::kRight).apply(&frame->right, &frame->right_path);
}

}  // namespace etalon
