#include "etalon/frontend/anchor_patch.h"

#include <Eigen/Dense>
#include <array>
#include <cmath>
#include <opencv2/core/hal/intrin.hpp>

namespace etalon {

namespace {

constexpr int kParameters = 6;  // a11, a12, a21, a22, tx, ty
using Vector6 = Eigen::Matrix<double, kParameters, 1>;
using Matrix6 = Eigen::Matrix<double, kParameters, kParameters>;

float dot(const float* a, const float* b, size_t count) {
  return Eigen::Map<const Eigen::VectorXf>(a, count).dot(
      Eigen::Map<const Eigen::VectorXf>(b, count));
}

/** Four values between `left` and `right`. */
cv::v_float32x4 between(const cv::v_int32x4& left, const cv::v_int32x4& step,
                        const cv::v_float32x4& share) {
  return cv::v_cvt_f32(left) + share * cv::v_cvt_f32(step);
}

/** Bilinear values of an 8-bit image at eight places inside it. */
void interpolateEight(const cv::Mat& image, const float* x, const float* y, float* values) {
  const auto step = static_cast<int>(image.step);
  const cv::v_int32x4 last_x = cv::v_setall_s32(image.cols - 2),
                      last_y = cv::v_setall_s32(image.rows - 2), steps = cv::v_setall_s32(step);
  std::array<int, 8> corner;  // upper left pixel
  std::array<cv::v_float32x4, 2> right, down;
  for (int half = 0; half < 2; ++half) {
    const cv::v_float32x4 px = cv::v_load(x + 4 * half), py = cv::v_load(y + 4 * half);
    // Not negative: truncation is the floor.
    const cv::v_int32x4 xi = cv::v_min(cv::v_trunc(px), last_x);
    const cv::v_int32x4 yi = cv::v_min(cv::v_trunc(py), last_y);
    right[half] = px - cv::v_cvt_f32(xi);
    down[half] = py - cv::v_cvt_f32(yi);
    cv::v_store(corner.data() + 4 * half, yi * steps + xi);
  }
  // Of neighbouring pixels the left one is the lower byte.
  const cv::v_uint16x8 byte = cv::v_setall_u16(255);
  const auto upper = cv::v_reinterpret_as_u16(cv::v_lut_pairs(image.data, corner.data()));
  const auto lower = cv::v_reinterpret_as_u16(cv::v_lut_pairs(image.data + step, corner.data()));
  std::array<cv::v_int32x4, 2> top, top_step, low, low_step;
  const auto split = [&byte](const cv::v_uint16x8& pairs, auto* left, auto* across) {
    const cv::v_int16x8 first = cv::v_reinterpret_as_s16(pairs & byte);
    cv::v_expand(first, (*left)[0], (*left)[1]);
    cv::v_expand(cv::v_reinterpret_as_s16(pairs >> 8) - first, (*across)[0], (*across)[1]);
  };
  split(upper, &top, &top_step);
  split(lower, &low, &low_step);
  for (int half = 0; half < 2; ++half) {
    const cv::v_float32x4 above = between(top[half], top_step[half], right[half]);
    const cv::v_float32x4 below = between(low[half], low_step[half], right[half]);
    cv::v_store(values + 4 * half, above + down[half] * (below - above));
  }
}

}  // namespace

bool AnchorPatch::sample(const cv::Mat& image, const PatchPose& pose,
                         std::vector<float>* values) const {
  const double r = radius_;
  const double reach_x = r * (std::abs(pose.A(0, 0)) + std::abs(pose.A(0, 1)));
  const double reach_y = r * (std::abs(pose.A(1, 0)) + std::abs(pose.A(1, 1)));
  if (!(pose.centre.x() >= reach_x && pose.centre.y() >= reach_y &&
        pose.centre.x() + reach_x < image.cols - 1 && pose.centre.y() + reach_y < image.rows - 1))
    return false;
  const int side = 2 * radius_ + 1, count = side * side;
  constexpr int kLanes = 8;  // a whole number of them is computed
  cv::AutoBuffer<float, 1024> x(count + kLanes), y(count + kLanes);
  const auto a00 = static_cast<float>(pose.A(0, 0)), a10 = static_cast<float>(pose.A(1, 0));
  for (int v = 0; v < side; ++v) {
    const double down = v - radius_;
    const auto x0 = static_cast<float>(pose.centre.x() - r * pose.A(0, 0) + down * pose.A(0, 1));
    const auto y0 = static_cast<float>(pose.centre.y() - r * pose.A(1, 0) + down * pose.A(1, 1));
    float *row_x = x.data() + v * side, *row_y = y.data() + v * side;
    for (int u = 0; u < side; ++u) {
      row_x[u] = x0 + static_cast<float>(u) * a00;
      row_y[u] = y0 + static_cast<float>(u) * a10;
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
  const Eigen::Matrix<float, Eigen::Dynamic, kParameters> scaled =
      G * factors.solve(Matrix6::Identity()).cast<float>();
  patch_.assign(T.data(), T.data() + count);
  steepest_descent_.assign(scaled.data(), scaled.data() + scaled.size());
}

double AnchorPatch::align(const cv::Mat& image, PatchPose* pose, int max_iterations,
                          double epsilon_px) const {
  std::vector<float> values;
  const size_t count = patch_.size();
  for (int iteration = 0; iteration < max_iterations; ++iteration) {
    if (!sample(image, *pose, &values)) return -1.0;
    const float gain = dot(values.data(), patch_.data(), count) / patch_squares_;
    if (gain < 0.1F) return -1.0;  // nothing of the patch is there
    Vector6 delta;
    for (int i = 0; i < kParameters; ++i)
      delta[i] = dot(&steepest_descent_[i * count], values.data(), count) / gain;
    Eigen::Matrix2d step;
    step << 1.0 + delta[0], delta[1], delta[2], 1.0 + delta[3];
    const double determinant = step.determinant();
    if (!(determinant > 0.25 && determinant < 4.0)) return -1.0;
    pose->A = pose->A * step.inverse();
    const Eigen::Vector2d moved = pose->A * delta.tail<2>();
    pose->centre -= moved;
    if (moved.norm() > epsilon_px) continue;
    // Of the values before this last step, which is too small to show.
    const Eigen::Map<const Eigen::VectorXf> I(values.data(), static_cast<Eigen::Index>(count));
    const float squares = (I.array() - I.mean()).square().sum();
    return gain * std::sqrt(patch_squares_ / std::max(squares, 1.0F));
  }
  return -1.0;
}

}  // namespace etalon
