#include "etalon/evaluation/alignment.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <limits>
#include <random>

#include "etalon/core/errors.h"
#include "etalon/core/so3.h"
#include "etalon/core/symmetric.h"

namespace etalon {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;
using Points = std::vector<Vector3d>;

class Random {
 public:
  explicit Random(unsigned seed) : generator_(seed) {}
  Vector3d vector(double sigma) {
    return sigma * Vector3d(normal_(generator_), normal_(generator_), normal_(generator_));
  }
  double uniform(double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(generator_);
  }
  Points points(int count, double sigma) {
    Points p;
    for (int i = 0; i < count; ++i) p.push_back(vector(sigma));
    return p;
  }

 private:
  std::mt19937 generator_;
  std::normal_distribution<double> normal_;
};

double cost(const Points& p_G, const Points& p_W, const Alignment& a) {
  double sum = 0.0;
  for (size_t i = 0; i < p_G.size(); ++i) sum += (p_G[i] - a * p_W[i]).squaredNorm();
  return sum;
}

/** Horn (JOSA 1987): the rotation is the eigenvector of greatest eigenvalue of a 4x4 matrix.
 * Another way than the SVD. */
Alignment alignByQuaternion(const Points& p_G, const Points& p_W, bool with_scale) {
  Vector3d mean_G = Vector3d::Zero(), mean_W = Vector3d::Zero();
  for (size_t i = 0; i < p_G.size(); ++i) {
    mean_G += p_G[i] / static_cast<double>(p_G.size());
    mean_W += p_W[i] / static_cast<double>(p_W.size());
  }
  Eigen::Matrix4d N = Eigen::Matrix4d::Zero();
  for (size_t i = 0; i < p_G.size(); ++i) {
    const Vector3d a = p_W[i] - mean_W, b = p_G[i] - mean_G;
    // b^T R(q) a as a quadratic form of q = (w, x, y, z).
    N(0, 0) += a.dot(b);
    const Vector3d axb = a.cross(b);
    N.block<1, 3>(0, 1) += axb.transpose();
    N.block<3, 1>(1, 0) += axb;
    N.block<3, 3>(1, 1) += a * b.transpose() + b * a.transpose() - a.dot(b) * Matrix3d::Identity();
  }
  const Eigen::Vector4d q = symmetricEigen(N).vectors.col(3);
  Alignment alignment;
  alignment.T_GW.R = Eigen::Quaterniond(q[0], q[1], q[2], q[3]).toRotationMatrix();
  if (with_scale) {
    double along = 0.0, spread = 0.0;
    for (size_t i = 0; i < p_G.size(); ++i) {
      along += (p_G[i] - mean_G).dot(alignment.T_GW.R * (p_W[i] - mean_W));
      spread += (p_W[i] - mean_W).squaredNorm();
    }
    alignment.scale = along / spread;
  }
  alignment.T_GW.t = mean_G - alignment.scale * alignment.T_GW.R * mean_W;
  return alignment;
}

TEST(Alignment, RecoversAKnownTransformation) {
  const Points p_W = {{0, 0, 0}, {1, 0, 0}, {0, 2, 0}, {0, 0, 3}};
  const Matrix3d R = expSO3(Vector3d(0.3, -1.2, 2.0));
  const Vector3d t(4.0, -5.0, 6.0);
  Points p_G;
  for (const Vector3d& p : p_W) p_G.push_back(2.5 * R * p + t);
  const Alignment a = alignPoints(p_G, p_W, AlignmentType::kSim3);
  // A few roundings of numbers of size 10.
  EXPECT_NEAR(a.scale, 2.5, 1e-13);
  EXPECT_LT((a.T_GW.R - R).norm(), 1e-13);
  EXPECT_LT((a.T_GW.t - t).norm(), 1e-13);
}

TEST(Alignment, AgreesWithHornsQuaternionMethodOnNoisyPoints) {
  Random random(7);
  for (int trial = 0; trial < 50; ++trial) {
    const Points p_W = random.points(20, 2.0);
    const Matrix3d R = expSO3(random.vector(1.5));
    const Vector3d t = random.vector(10.0);
    const double scale = random.uniform(0.5, 2.0);
    Points p_G;
    for (const Vector3d& p : p_W) p_G.push_back(scale * R * p + t + random.vector(0.3));
    for (const bool with_scale : {false, true}) {
      const Alignment a =
          alignPoints(p_G, p_W, with_scale ? AlignmentType::kSim3 : AlignmentType::kSE3);
      const Alignment b = alignByQuaternion(p_G, p_W, with_scale);
      // Both are exact; the eigenproblem's conditioning costs a few digits.
      EXPECT_LT((a.T_GW.R - b.T_GW.R).norm(), 1e-11);
      EXPECT_LT((a.T_GW.t - b.T_GW.t).norm(), 1e-10);
      EXPECT_NEAR(a.scale, b.scale, 1e-11);
      EXPECT_EQ(a.scale == 1.0, !with_scale);
    }
  }
}

TEST(Alignment, NeverReflects) {
  Random random(8);
  const Points p_W = random.points(10, 1.0);
  Points p_G;
  for (const Vector3d& p : p_W) p_G.push_back({p.x(), p.y(), -p.z()});
  for (const AlignmentType type : {AlignmentType::kSE3, AlignmentType::kSim3}) {
    const Alignment a = alignPoints(p_G, p_W, type);
    EXPECT_NEAR(a.T_GW.R.determinant(), 1.0, 1e-12);
    EXPECT_LT((a.T_GW.R - alignByQuaternion(p_G, p_W, false).T_GW.R).norm(), 1e-11);
  }
}

TEST(Alignment, YawAndPositionTurnAboutTheVerticalOnly) {
  Random random(9);
  for (int trial = 0; trial < 20; ++trial) {
    const Points p_W = random.points(15, 2.0);
    const double yaw = random.uniform(-M_PI, M_PI);
    const Matrix3d R =
        expSO3(random.vector(0.02)) * expSO3(Vector3d(0, 0, yaw));  // tilted a little
    Points p_G;
    for (const Vector3d& p : p_W) p_G.push_back(R * p + Vector3d(1, 2, 3) + random.vector(0.05));
    const Alignment a = alignPoints(p_G, p_W, AlignmentType::kYawPosition);
    EXPECT_LT((a.T_GW.R.col(2) - Vector3d::UnitZ()).norm(), 1e-15);
    // No other yaw is better, to first and second order: the cost's minimum is where it was found.
    const double best = cost(p_G, p_W, a);
    for (const double turn : {-1.0, -0.1, -1e-4, 1e-4, 0.1, 1.0, 3.0}) {
      Alignment turned = a;
      turned.T_GW.R = expSO3(Vector3d(0, 0, turn)) * a.T_GW.R;
      Vector3d mean_G = Vector3d::Zero(), mean_W = Vector3d::Zero();
      for (size_t i = 0; i < p_G.size(); ++i) {
        mean_G += p_G[i] / 15.0;
        mean_W += p_W[i] / 15.0;
      }
      turned.T_GW.t = mean_G - turned.T_GW.R * mean_W;
      EXPECT_GT(cost(p_G, p_W, turned), best);
    }
  }
}

TEST(Alignment, DegeneratePointsGiveAMinimiser) {
  const Points one_W = {{1, 2, 3}}, one_G = {{4, 4, 4}};
  const Points line_W = {{0, 0, 0}, {1, 0, 0}, {2, 0, 0}},
               line_G = {{0, 0, 1}, {0, 1, 1}, {0, 2, 1}};
  for (const AlignmentType type :
       {AlignmentType::kSE3, AlignmentType::kSim3, AlignmentType::kYawPosition}) {
    const Alignment one = alignPoints(one_G, one_W, type);
    EXPECT_LT(cost(one_G, one_W, one), 1e-24);
    EXPECT_EQ(one.scale, 1.0);
    const Alignment line = alignPoints(line_G, line_W, type);
    EXPECT_LT(cost(line_G, line_W, line), 1e-24);
    EXPECT_NEAR(line.T_GW.R.determinant(), 1.0, 1e-12);
  }
}

TEST(Alignment, RefusesWhatIsNotPairsOfFinitePoints) {
  const Points two = {{0, 0, 0}, {1, 0, 0}};
  const Points nan = {{0, 0, 0}, {1, std::numeric_limits<double>::quiet_NaN(), 0}};
  EXPECT_THROW(alignPoints(two, {{0, 0, 0}}, AlignmentType::kSE3), Error);
  EXPECT_THROW(alignPoints({}, {}, AlignmentType::kSE3), Error);
  EXPECT_THROW(alignPoints(two, nan, AlignmentType::kSim3), Error);
}

TEST(Alignment, MovesWholePoses) {
  Alignment a;
  a.T_GW = SE3(expSO3(Vector3d(0, 0, M_PI / 2)), Vector3d(1, 0, 0));
  a.scale = 2.0;
  const SE3 T_WB(expSO3(Vector3d(0.1, 0, 0)), Vector3d(3, 0, 0));
  const Trajectory moved = transformed({{5, T_WB}}, a);
  ASSERT_EQ(moved.size(), 1u);
  EXPECT_EQ(moved[0].t, 5);
  EXPECT_LT((moved[0].T_WB.t - Vector3d(1, 6, 0)).norm(), 1e-14);
  EXPECT_LT((moved[0].T_WB.R - a.T_GW.R * T_WB.R).norm(), 1e-15);
}

}  // namespace
}  // namespace etalon
