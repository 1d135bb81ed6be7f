#include "etalon/frontend/anchor_patch.h"

#include <Eigen/Dense>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <opencv2/core/hal/intrin.hpp>

namespace etalon {

namespace {

constexpr int kParameters = 6;  // a11, a12, a21, a22, tx, ty
using Vector6 = Eigen::Matrix<double, kParameters, 1>;
using Matrix6 = Eigen::Matrix<double, kParameters, kParameters>;

/** Places in an image are counted in 1/65536 px, its gray levels in 1/16384. */
constexpr int kPlaceBits = 16, kGrayBits = 14;

int fixedPoint(double px) { return cvRound(px * (1 << kPlaceBits)); }

/** Eight neighbouring pairs of pixels, the left ones at these places: what cv::v_lut_pairs() gives,
 * whose loads of two bytes want even addresses by the rules of the language. */
cv::v_uint8x16 pairsAt(const std::uint8_t* pixels, const std::array<int, 8>& places) {
  std::array<std::uint16_t, 8> p;
  for (int i = 0; i < 8; ++i) std::memcpy(&p[i], pixels + places[i], sizeof p[i]);
  return cv::v_reinterpret_as_u8(cv::v_uint16x8(p[0], p[1], p[2], p[3], p[4], p[5], p[6], p[7]));
}

/** Bilinear values of an 8-bit image at eight places inside it. */
void interpolateEight(const cv::Mat& image, const int* x, const int* y, float* values) {
  const cv::v_int32x4 fraction = cv::v_setall_s32((1 << kPlaceBits) - 1);
  const cv::v_int32x4 whole = cv::v_setall_s32(1 << kGrayBits);
  const cv::v_int16x8 steps =  // by a column and by a row, in turn
      cv::v_reinterpret_as_s16(cv::v_setall_s32((static_cast<int>(image.step) << 16) + 1));
  std::array<int, 8> corner;            // upper left pixel
  std::array<cv::v_int16x8, 2> across;  // weights of the left and the right pixel, in turn
  std::array<cv::v_float32x4, 2> down;
  for (int half = 0; half < 2; ++half) {
    const cv::v_int32x4 px = cv::v_load(x + 4 * half), py = cv::v_load(y + 4 * half);
    const cv::v_int32x4 pixel = (cv::v_shr<kPlaceBits>(py) << 16) | cv::v_shr<kPlaceBits>(px);
    cv::v_store(corner.data() + 4 * half, cv::v_dotprod(cv::v_reinterpret_as_s16(pixel), steps));
    const cv::v_int32x4 right = cv::v_shr<kPlaceBits - kGrayBits>(px & fraction);
    across[half] = cv::v_reinterpret_as_s16((right << 16) | (whole - right));
    down[half] = cv::v_cvt_f32(py & fraction) * cv::v_setall_f32(1.0F / (1 << kPlaceBits));
  }
  std::array<cv::v_uint16x8, 2> upper, lower;
  cv::v_expand(pairsAt(image.data, corner), upper[0], upper[1]);
  cv::v_expand(pairsAt(image.data + image.step, corner), lower[0], lower[1]);
  for (int half = 0; half < 2; ++half) {
    const cv::v_float32x4 above =
        cv::v_cvt_f32(cv::v_dotprod(cv::v_reinterpret_as_s16(upper[half]), across[half]));
    const cv::v_float32x4 below =
        cv::v_cvt_f32(cv::v_dotprod(cv::v_reinterpret_as_s16(lower[half]), across[half]));
    cv::v_store(values + 4 * half,
                (above + down[half] * (below - above)) * cv::v_setall_f32(1.0F / (1 << kGrayBits)));
  }
}

}  // namespace

bool AnchorPatch::sample(const cv::Mat& image, const PatchPose& pose,
                         std::vector<float>* values) const {
  constexpr double kRounding = 0.001;  // px, of places
  const double r = radius_;
  const double reach_x = r * (std::abs(pose.A(0, 0)) + std::abs(pose.A(0, 1))) + kRounding;
  const double reach_y = r * (std::abs(pose.A(1, 0)) + std::abs(pose.A(1, 1))) + kRounding;
  if (!(pose.centre.x() >= reach_x && pose.centre.y() >= reach_y &&
        pose.centre.x() + reach_x < image.cols - 1 && pose.centre.y() + reach_y < image.rows - 1))
    return false;
  const int side = 2 * radius_ + 1, count = side * side;
  constexpr int kLanes = 8;  // a whole number of them is computed
  cv::AutoBuffer<int, 1024> x(count + kLanes), y(count + kLanes);
  const int right_x = fixedPoint(pose.A(0, 0)), right_y = fixedPoint(pose.A(1, 0));
  for (int v = 0; v < side; ++v) {
    const Eigen::Vector2d left = pose.centre + pose.A * Eigen::Vector2d(-r, v - r);
    int place_x = fixedPoint(left.x()), place_y = fixedPoint(left.y());
    for (int i = v * side; i < (v + 1) * side; ++i, place_x += right_x, place_y += right_y) {
      x[i] = place_x;
      y[i] = place_y;
    }
  }
  std::fill_n(x.data() + count, kLanes, x[count - 1]);
  std::fill_n(y.data() + count, kLanes, y[count - 1]);
  values->resize(count + kLanes);
  for (int i = 0; i < count; i += kLanes)
    interpolateEight(image, x.data() + i, y.data() + i, values->data() + i);
  return true;
}

AnchorPatch::AnchorPatch(const cv::Mat& image, const Eigen::Vector2d& centre, int side) {
  // One pixel more on every side, for the derivatives.
  radius_ = side / 2 + 1;
  std::vector<float> wide;
  const bool inside = sample(image, {centre, Eigen::Matrix2d::Identity()}, &wide);
  --radius_;
  if (!inside) return;
  const int inner = 2 * radius_ + 1, outer = inner + 2;
  const Eigen::Index count = inner * inner;
  Eigen::VectorXf T(count);
  Eigen::Matrix<float, Eigen::Dynamic, kParameters> G(count, kParameters);
  for (int v = 0; v < inner; ++v)
    for (int u = 0; u < inner; ++u) {
      const float* p = wide.data() + (v + 1) * outer + u + 1;
      const float gx = 0.5F * (p[1] - p[-1]), gy = 0.5F * (p[outer] - p[-outer]);
      const auto dx = static_cast<float>(u - radius_), dy = static_cast<float>(v - radius_);
      const Eigen::Index i = v * inner + u;
      T[i] = p[0];
      G.row(i) << gx * dx, gx * dy, gy * dx, gy * dy, gx, gy;
    }
  T.array() -= T.mean();
  patch_squares_ = T.squaredNorm();
  if (patch_squares_ < static_cast<float>(count)) return;  // under one gray level of contrast
  G.rowwise() -= G.colwise().mean().eval();
  G -= T * (T.transpose() * G).eval() / patch_squares_;
  const Matrix6 H = (G.transpose() * G).cast<double>();
  const Eigen::LDLT<Matrix6> factors(H);
  if (factors.info() != Eigen::Success || factors.vectorD().minCoeff() < 1e-3) return;
  products_.resize(count, Eigen::NoChange);
  products_.col(0) = T;
  products_.rightCols<kParameters>().noalias() =
      G * factors.solve(Matrix6::Identity()).cast<float>();
}

double AnchorPatch::align(const cv::Mat& image, PatchPose* pose, int max_iterations,
                          double epsilon_px) const {
  std::vector<float> values;
  double last_step_px = 0.0;
  for (int iteration = 0; iteration < max_iterations; ++iteration) {
    if (!sample(image, *pose, &values)) return -1.0;
    const Eigen::Map<const Eigen::VectorXf> I(values.data(), products_.rows());
    const Eigen::Matrix<float, 1 + kParameters, 1> products = products_.transpose() * I;
    const float gain = products[0] / patch_squares_;
    if (gain < 0.1F) return -1.0;  // nothing of the patch is there
    const Vector6 delta = (products.tail<kParameters>() / gain).cast<double>();
    Eigen::Matrix2d step;
    step << 1.0 + delta[0], delta[1], delta[2], 1.0 + delta[3];
    const double determinant = step.determinant();
    if (!(determinant > 0.25 && determinant < 4.0)) return -1.0;
    pose->A = pose->A * step.inverse();
    const Eigen::Vector2d moved = pose->A * delta.tail<2>();
    pose->centre -= moved;
    // Steps shrink by a factor: the next one is not worth its evaluation if it would be too small.
    const double step_px = moved.norm();
    const bool converges = step_px < 0.5 * last_step_px;
    const bool last =
        step_px <= epsilon_px || (converges && step_px * step_px <= epsilon_px * last_step_px);
    last_step_px = step_px;
    if (!last) continue;
    // Of the values before this last step, which is too small to show.
    const float squares = (I.array() - I.mean()).square().sum();
    return gain * std::sqrt(patch_squares_ / std::max(squares, 1.0F));
  }
  return -1.0;
}

}  // namespace etalon
