#include "texture.h"

#include <algorithm>
#include <cmath>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>

#include "random.h"

namespace etalon {

namespace {

constexpr int kSize = Texture::kSize;
/** Corners of one shape around the origin, in texels. */
std::vector<cv::Point2d> randomShape(double radius, Random* random) {
  const double angle = random->uniform(0.0, 2.0 * M_PI);
  const int kind = random->uniformInt(4);
  std::vector<cv::Point2d> corners;
  if (kind <= 1) {  // rectangle
    const double aspect = random->uniform(0.4, 1.0);
    corners = {{-1.0, -aspect}, {1.0, -aspect}, {1.0, aspect}, {-1.0, aspect}};
  } else if (kind == 2) {  // triangle or quadrangle with uneven sides
    const int count = 3 + random->uniformInt(2);
    for (int i = 0; i < count; ++i) {
      const double a = 2.0 * M_PI * (i + random->uniform(-0.25, 0.25)) / count;
      corners.emplace_back(std::cos(a), std::sin(a));
    }
  } else {  // disk
    const double aspect = random->uniform(0.6, 1.0);
    for (int i = 0; i < 24; ++i) {
      const double a = 2.0 * M_PI * i / 24;
      corners.emplace_back(std::cos(a), aspect * std::sin(a));
    }
  }
  const double c = radius * std::cos(angle), s = radius * std::sin(angle);
  for (cv::Point2d& p : corners) p = {c * p.x - s * p.y, s * p.x + c * p.y};
  return corners;
}

/** Fills a convex polygon, repeated across the borders of the texture, with antialiased edges. */
void fillWrapped(cv::Mat* image, const std::vector<cv::Point2d>& corners, cv::Point2d centre,
                 double radius, double gray) {
  constexpr int kShift = 6;
  std::vector<cv::Point> fixed(corners.size());
  for (int dy = -1; dy <= 1; ++dy) {
    for (int dx = -1; dx <= 1; ++dx) {
      const cv::Point2d c(centre.x + dx * kSize, centre.y + dy * kSize);
      if (c.x + radius < 0 || c.y + radius < 0 || c.x - radius > kSize || c.y - radius > kSize) {
        continue;
      }
      for (size_t i = 0; i < corners.size(); ++i) {
        fixed[i] = {cvRound((c.x + corners[i].x) * (1 << kShift)),
                    cvRound((c.y + corners[i].y) * (1 << kShift))};
      }
      cv::fillConvexPoly(*image, fixed, cv::Scalar(gray), cv::LINE_AA, kShift);
    }
  }
}

/** Rectangular tiles of uneven brightness with dark joints. */
void drawTiles(cv::Mat* image, int width, int height, Random* random) {
  for (int y = 0; y < kSize; y += height) {
    for (int x = 0; x < kSize; x += width) {
      const double gray = random->uniform(85.0, 165.0);
      image->rowRange(y, y + height).colRange(x, x + width).setTo(cv::Scalar(0.6 * gray));
      image->rowRange(y + 1, y + height - 1).colRange(x + 1, x + width - 1).setTo(cv::Scalar(gray));
    }
  }
}

/**
 * Shapes from large to small, each lighter or darker than what it lies on: contrast at every scale
 * survives. Small ones are rarer and fainter, as on the surfaces of a real room. `share` scales
 * their number.
 */
void drawShapes(cv::Mat* image, double share, Random* random) {
  struct Octave {
    double radius, coverage, contrast;  // texels, share of the area, gray levels
  };
  constexpr Octave kOctaves[] = {{180.0, 0.45, 60.0}, {90.0, 0.30, 55.0}, {45.0, 0.20, 55.0},
                                 {22.0, 0.12, 50.0},  {11.0, 0.08, 50.0}, {5.5, 0.05, 45.0},
                                 {3.0, 0.025, 40.0}};
  for (const Octave& octave : kOctaves) {
    const double area = 2.0 * octave.radius * octave.radius;
    const int count = static_cast<int>(share * octave.coverage * kSize * kSize / area);
    for (int i = 0; i < count; ++i) {
      const double radius = octave.radius * random->uniform(0.7, 1.4);
      const cv::Point2d centre(random->uniform(0.0, kSize), random->uniform(0.0, kSize));
      const auto corners = randomShape(radius, random);
      const double under = image->at<std::uint8_t>(static_cast<int>(centre.y) & (kSize - 1),
                                                   static_cast<int>(centre.x) & (kSize - 1));
      const double step = octave.contrast * random->uniform(0.4, 1.4);
      const bool lighter = random->uniform() < (under < 128.0 ? 0.65 : 0.35);
      const double gray = std::clamp(under + (lighter ? step : -step), 15.0, 235.0);
      fillWrapped(image, corners, centre, 1.5 * radius, gray);
    }
  }
}

/** Adds seeded noise: a lattice of every texel and one of every fourth, the latter interpolated. */
void addNoise(cv::Mat* image, Random* random) {
  cv::Mat coarse(kSize / 4, kSize / 4, CV_32F), fine(kSize, kSize, CV_32F), spread;
  for (int i = 0; i < coarse.rows * coarse.cols; ++i) {
    coarse.ptr<float>()[i] = static_cast<float>(random->uniform(-8.0, 8.0));
  }
  for (int i = 0; i < fine.rows * fine.cols; ++i) {
    fine.ptr<float>()[i] = static_cast<float>(random->uniform(-6.0, 6.0));
  }
  cv::resize(coarse, spread, fine.size(), 0, 0, cv::INTER_LINEAR);
  for (int y = 0; y < kSize; ++y) {
    for (int x = 0; x < kSize; ++x) {
      const float gray =
          image->at<std::uint8_t>(y, x) + spread.at<float>(y, x) + fine.at<float>(y, x);
      image->at<std::uint8_t>(y, x) = cv::saturate_cast<std::uint8_t>(gray);
    }
  }
}

}  // namespace

Texture::Texture(std::uint64_t seed, std::uint64_t index) {
  Random random(mixBits(seed) + index, kTextureStream);
  cv::Mat image(kSize, kSize, CV_8UC1, cv::Scalar(random.uniform(95.0, 150.0)));
  const bool tiled = index % 2 == 1;
  if (tiled) drawTiles(&image, 128, index % 4 == 1 ? 128 : 64, &random);
  drawShapes(&image, tiled ? 0.5 : 1.0, &random);
  addNoise(&image, &random);
  int shift = 11;
  static_assert(kSize == 1 << 11);
  for (int size = kSize; size >= 4; size /= 2, --shift) {
    Level level{static_cast<float>(size) / kSize, size - 1, shift, {}};
    level.texels.resize(static_cast<size_t>(size) * static_cast<size_t>(size));
    if (levels_.empty()) {
      for (int y = 0; y < size; ++y) {
        std::copy_n(image.ptr<std::uint8_t>(y), size,
                    level.texels.begin() + static_cast<std::ptrdiff_t>(y) * size);
      }
    } else {
      const Level& above = levels_.back();
      const size_t n = size;
      for (size_t y = 0; y < n; ++y) {
        for (size_t x = 0; x < n; ++x) {
          const std::uint8_t* p = above.texels.data() + 2 * y * 2 * n + 2 * x;
          const int sum = p[0] + p[1] + p[2 * n] + p[2 * n + 1];
          level.texels[y * n + x] = static_cast<std::uint8_t>((sum + 2) / 4);
        }
      }
    }
    levels_.push_back(std::move(level));
  }
}

}  // namespace etalon
