#pragma once

#include <array>
#include <vector>

#include "chain.h"
#include "etalon/core/nav_state.h"
#include "etalon/core/trajectory.h"
#include "etalon/imu/imu_buffer.h"
#include "etalon/imu/preintegration.h"

namespace etalon::ground_truth {

/** Over a longer step between samples the IMU does not tell the motion, s. */
constexpr double kMaxImuGapS = 0.1;

/** Offsets in a node's unknowns: state_index, then the two correlated errors, each with its rate
 * behind it. */
constexpr int kPositionError = state_index::kSize;
constexpr int kRotationError = kPositionError + 6;

/** Offsets in the border's unknowns. */
constexpr int kPositionShift = 0;
constexpr int kRotationShift = 1;
constexpr int kTurn = 2;
constexpr int kLever = 5;
constexpr int kGravity = 8;

/** What all nodes share. */
struct Shared {
  double position_shift_s = 0.0, rotation_shift_s = 0.0;
  Eigen::Matrix3d R_BM = Eigen::Matrix3d::Identity();
  Eigen::Vector3d lever_B = Eigen::Vector3d::Zero();
  Eigen::Vector3d g_G{0.0, 0.0, -9.81};
};

/** One row of the recording and the body at its stamp. */
struct Node {
  StampedState body;  ///< in G
  /** The correlated errors: of the position (m, in G), its rate times the correlation time, and the
   * same two of the rotation (rad, in M). */
  Eigen::Matrix<double, 3, 4> errors = Eigen::Matrix<double, 3, 4>::Zero();
  SE3 T_GM;             ///< the row
  bool counts = false;  ///< whether the row is believed
};

/** The four sources of an IMU's errors, in the order of the covariances below. */
enum ImuSource { kGyroNoise, kGyroWalk, kAccelNoise, kAccelWalk, kImuSources };

/** The IMU between a node and the next, linearised. */
struct MotionTerm {
  Eigen::Matrix<double, 15, 15> J_this, J_next;
  Eigen::Matrix<double, 15, 3> J_gravity;
  Eigen::Matrix<double, 15, 1> residual;
  std::array<Eigen::Matrix<double, 15, 15>, kImuSources> covariance;  ///< at the data sheet
  double dt = 0.0;                                                    ///< s
  bool known = false;                                                 ///< whether the IMU covers it
};

/** The row of a node, linearised: 3 each of position (m) and rotation (rad); the residual is what is
 * measured less what is expected, the correlated error in both. */
struct RowTerm {
  Eigen::Matrix<double, 3, kNodeSize> J_position, J_rotation;
  Eigen::Matrix<double, 3, kBorderSize> G_position, G_rotation;
  Eigen::Vector3d position, rotation;
};

/** All terms at one point of linearisation, but for the bandwidths. */
struct Linearisation {
  std::vector<MotionTerm> motions;  ///< one fewer than nodes
  std::vector<Node> nodes;          ///< where it was made
  Shared shared;

  /** What a tracker sees at the rows beside the body, in G, a column a node: p_GM - p_GB (m), and
   * Log(R_GM R_GB^T) (rad); below them their derivatives by the border, a column after the other. */
  Eigen::MatrixXd position_offset, rotation_offset;
  std::vector<Eigen::Index> stretches;  ///< first nodes of those without gaps
  double step_s = 0.0;                  ///< of the nodes

  /** The rows at these bandwidths. */
  std::vector<RowTerm> rows(double position_hz, double rotation_hz) const;
};

/** A flight: what is estimated of it, and the terms that say so. */
class FlightModel {
 public:
  /** @param imu must outlive this; covers all rows */
  FlightModel(const std::vector<StampedState>& rows, const ImuBuffer& imu,
              const ImuNoiseDensities& data_sheet, double step_s, double row_step_s);

  size_t size() const { return nodes_.size(); }
  const std::vector<Node>& nodes() const { return nodes_; }
  const Shared& shared() const { return shared_; }

  Linearisation linearise() const;
  void add(const std::vector<NodeVector>& nodes, const BorderVector& border);

 private:
  bool known(TimeNs from, TimeNs to) const;  ///< whether the IMU tells the motion
  MotionTerm motionTerm(size_t k) const;
  void setOffsets(size_t k, Linearisation* linear) const;

  const ImuBuffer* imu_;
  ImuNoiseDensities data_sheet_;
  std::vector<Node> nodes_;
  Shared shared_;
  double step_s_ = 0.0;
};

}  // namespace etalon::ground_truth
