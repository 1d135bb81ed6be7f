#include "etalon/frontend/anchor_patch.h"

#include <Eigen/Dense>
#include <cmath>

namespace etalon {

namespace {

constexpr int kParameters = 6;  // a11, a12, a21, a22, tx, ty
using Vector6 = Eigen::Matrix<double, kParameters, 1>;
using Matrix6 = Eigen::Matrix<double, kParameters, kParameters>;

float dot(const float* a, const float* b, size_t count) {
  return Eigen::Map<const Eigen::VectorXf>(a, count).dot(
      Eigen::Map<const Eigen::VectorXf>(b, count));
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
  const int side = 2 * radius_ + 1;
  values->resize(side * side);
  float* out = values->data();
  const auto a00 = static_cast<float>(pose.A(0, 0)), a10 = static_cast<float>(pose.A(1, 0));
  const size_t step = image.step;
  for (int v = -radius_; v <= radius_; ++v) {
    auto x = static_cast<float>(pose.centre.x() - r * pose.A(0, 0) + v * pose.A(0, 1));
    auto y = static_cast<float>(pose.centre.y() - r * pose.A(1, 0) + v * pose.A(1, 1));
    for (int u = 0; u < side; ++u, x += a00, y += a10) {
      // Not negative: truncation is the floor.
      const int xi = std::min(static_cast<int>(x), image.cols - 2);
      const int yi = std::min(static_cast<int>(y), image.rows - 2);
      const float a = x - static_cast<float>(xi), b = y - static_cast<float>(yi);
      const uchar* p = image.data + static_cast<size_t>(yi) * step + xi;
      const float top = static_cast<float>(p[0]) + a * static_cast<float>(p[1] - p[0]);
      const float low = static_cast<float>(p[step]) + a * static_cast<float>(p[step + 1] - p[step]);
      *out++ = top + b * (low - top);
    }
  }
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
    if (!sample(image, *pose, &values)) return -1.0;
    const Eigen::Map<const Eigen::VectorXf> I(values.data(), count);
    const float squares = (I.array() - I.mean()).square().sum();
    return dot(values.data(), patch_.data(), count) /
           std::sqrt(patch_squares_ * std::max(squares, 1.0F));
  }
  return -1.0;
}

}  // namespace etalon
