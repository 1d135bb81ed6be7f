// Patches of the current image in images of the past.

#include "etalon/map/image_views.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <opencv2/imgproc.hpp>

#include "etalon/simulation/euroc_rig.h"

namespace etalon {
namespace {

using Eigen::Matrix2d;
using Eigen::Vector2d;

constexpr int kWidth = 400, kHeight = 300;

/** Blobs of a few pixels, seeded. */
cv::Mat texture(int seed) {
  cv::Mat image(kHeight, kWidth, CV_8UC1);
  cv::RNG random(static_cast<std::uint64_t>(seed));
  random.fill(image, cv::RNG::UNIFORM, 0, 255);
  cv::GaussianBlur(image, image, {}, 2.5);
  cv::normalize(image, image, 20, 235, cv::NORM_MINMAX);
  return image;
}

/** The view shows A (x - c) + c + t where the current image shows x. */
struct Motion {
  Matrix2d A;
  Vector2d t;
  Vector2d operator()(const Vector2d& x) const {
    const Vector2d c(0.5 * kWidth, 0.5 * kHeight);
    return A * (x - c) + c + t;
  }
  cv::Mat apply(const cv::Mat& image) const {
    const Vector2d origin = (*this)(Vector2d::Zero());
    const cv::Mat M =
        (cv::Mat_<double>(2, 3) << A(0, 0), A(0, 1), origin.x(), A(1, 0), A(1, 1), origin.y());
    cv::Mat moved;
    cv::warpAffine(image, moved, M, image.size(), cv::INTER_CUBIC);
    return moved;
  }
};

class ImageViewsTest : public ::testing::Test {
 protected:
  ImageViewsTest() {
    views_.show(motion_.apply(current_), right_.apply(current_));
    views_.keep(7);
    views_.show(current_, current_);
  }
  ViewQuery query(const Vector2d& pixel, const Vector2d& error, double reach) const {
    ViewQuery q;
    q.id = static_cast<LandmarkId>(1000 * pixel.x() + pixel.y());
    q.pixel = pixel;
    q.left = motion_(pixel) + error;
    q.right = right_(pixel) + error;
    q.has_right = true;
    q.reach_px = reach;
    return q;  // A stays the identity: the alignment finds it
  }
  std::vector<ViewQuery> queries(const Vector2d& error, double reach) const {
    std::vector<ViewQuery> all;
    for (double x = 100.0; x <= 300.0; x += 50.0)
      for (double y = 90.0; y <= 210.0; y += 40.0) all.push_back(query({x, y}, error, reach));
    return all;
  }

  cv::Mat current_ = texture(1);
  Motion motion_{(Matrix2d() << 1.06, -0.08, 0.07, 0.97).finished(), {6.3, -4.6}};
  Motion right_{(Matrix2d() << 1.06, -0.08, 0.07, 0.97).finished(), {-8.2, -4.6}};
  ImageViews views_{eurocCalibration()};
};

TEST_F(ImageViewsTest, FindsLandmarksToAFractionOfAPixelFromAFarGuess) {
  const auto asked = queries({7.0, -4.0}, 12.0);
  const auto matches = views_.find(7, asked);
  size_t found = 0;
  for (size_t i = 0; i < asked.size(); ++i) {
    if (!matches[i].found) continue;
    ++found;
    EXPECT_LT((matches[i].left - motion_(asked[i].pixel)).norm(), 0.1) << i;
    if (matches[i].has_right) {
      EXPECT_LT((matches[i].right - right_(asked[i].pixel)).norm(), 0.1) << i;
    }
  }
  EXPECT_GE(found, asked.size() * 3 / 4);
}

TEST_F(ImageViewsTest, FindsHardlyAnythingBeyondItsReachNorInAnotherPlace) {
  // With affine freedom one patch in ten of such a texture fits somewhere by chance; agreeing() is
  // for those.
  const auto found = [](const std::vector<ViewMatch>& matches) {
    return std::count_if(matches.begin(), matches.end(),
                         [](const ViewMatch& m) { return m.found; });
  };
  EXPECT_LE(found(views_.find(7, queries({7.0, -4.0}, 2.0))), 2);
  views_.show(texture(2), texture(2));
  EXPECT_LE(found(views_.find(7, queries({0.0, 0.0}, 3.0))), 2);
}

TEST(ImageViews, AViewOfWhichOneImageIsBlackHasNoFeatures) {
  const cv::Mat black = cv::Mat::zeros(kHeight, kWidth, CV_8UC1);
  for (const bool left_is_black : {true, false}) {
    ImageViews views(eurocCalibration());
    views.show(left_is_black ? black : texture(1), left_is_black ? texture(1) : black);
    EXPECT_EQ(views.keep(7), !left_is_black);  // it could never be found again
    EXPECT_NO_THROW(views.prepare(7));
  }
}

TEST_F(ImageViewsTest, AViewThatWasDroppedShowsNothing) {
  views_.keep(8);
  views_.dropAllBut({8});
  for (const ViewMatch& match : views_.find(7, queries({0.0, 0.0}, 3.0))) EXPECT_FALSE(match.found);
  ViewQuery same = query({200.0, 150.0}, {0.0, 0.0}, 3.0);
  same.left = same.right = same.pixel;
  EXPECT_TRUE(views_.find(8, {same})[0].found);
}

}  // namespace
}  // namespace etalon
