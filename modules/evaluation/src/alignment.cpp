#include "etalon/evaluation/alignment.h"

#include <Eigen/Geometry>
#include <Eigen/SVD>

#include "etalon/core/errors.h"
#include "etalon/core/yaw.h"

namespace etalon {
namespace {

Eigen::Vector3d meanOf(const std::vector<Eigen::Vector3d>& points) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (const Eigen::Vector3d& p : points) sum += p;
  return sum / static_cast<double>(points.size());
}

void checkPoints(const std::vector<Eigen::Vector3d>& p_G, const std::vector<Eigen::Vector3d>& p_W) {
  if (p_G.size() != p_W.size() || p_G.empty())
    throw Error("alignment: expected as many points on both sides and at least one, got " +
                std::to_string(p_G.size()) + " and " + std::to_string(p_W.size()));
  for (size_t i = 0; i < p_G.size(); ++i)
    if (!p_G[i].allFinite() || !p_W[i].allFinite())
      throw Error("alignment: point " + std::to_string(i) + " is not finite");
}

}  // namespace

Alignment alignPoints(const std::vector<Eigen::Vector3d>& p_G,
                      const std::vector<Eigen::Vector3d>& p_W, AlignmentType type) {
  checkPoints(p_G, p_W);
  const Eigen::Vector3d mean_G = meanOf(p_G), mean_W = meanOf(p_W);
  Eigen::Matrix3d cross = Eigen::Matrix3d::Zero();  // sum of (p_G - mean_G) (p_W - mean_W)^T
  double spread_W = 0.0;                            // sum of |p_W - mean_W|^2
  for (size_t i = 0; i < p_G.size(); ++i) {
    cross += (p_G[i] - mean_G) * (p_W[i] - mean_W).transpose();
    spread_W += (p_W[i] - mean_W).squaredNorm();
  }

  Alignment alignment;
  if (type == AlignmentType::kYawPosition) {
    alignment.T_GW.R = turnAboutZ(aligningYaw(cross));
  } else {
    const Eigen::JacobiSVD<Eigen::Matrix3d> svd(cross, Eigen::ComputeFullU | Eigen::ComputeFullV);
    Eigen::Vector3d signs = Eigen::Vector3d::Ones();
    if (svd.matrixU().determinant() * svd.matrixV().determinant() < 0.0) signs.z() = -1.0;
    alignment.T_GW.R = svd.matrixU() * signs.asDiagonal() * svd.matrixV().transpose();
    const double spread_along = svd.singularValues().dot(signs);
    if (type == AlignmentType::kSim3 && spread_W > 0.0 && spread_along > 0.0)
      alignment.scale = spread_along / spread_W;
  }
  alignment.T_GW.t = mean_G - alignment.scale * (alignment.T_GW.R * mean_W);
  return alignment;
}

Trajectory transformed(const Trajectory& trajectory, const Alignment& alignment) {
  Trajectory result = trajectory;
  for (StampedPose& pose : result) pose.T_WB = alignment * pose.T_WB;
  return result;
}

}  // namespace etalon
