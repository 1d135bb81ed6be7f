#include "flight_model.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "etalon/core/so3.h"
#include "etalon/optimization/residuals/inertial_residual.h"
#include "low_pass.h"

namespace etalon::ground_truth {
namespace {

namespace ix = state_index;
using Eigen::Matrix3d;
using Eigen::Vector3d;

/** Rows further apart than so many steps end a stretch. */
constexpr double kGapSteps = 4.0;
/** Rows of an offset: itself and its derivatives by the border. */
constexpr int kOffsetRows = 3 * (1 + kBorderSize);

/** The body a little before or after, as the IMU says. */
NavState carried(const ImuBuffer& imu, const NavState& body, TimeNs t, double shift_s,
                 const Vector3d& g_G) {
  NavState there = body;
  const TimeNs to = t + durationNs(shift_s);
  const auto samples = imu.between(std::min(t, to), std::max(t, to));
  if (samples.size() < 2) return there;
  const Preintegration motion(samples, body.bias, {});
  if (shift_s > 0.0) return motion.predict(body, g_G);
  const double dt = motion.dt();
  there.T_WB.R = body.T_WB.R * motion.deltas().dR.transpose();
  there.v_WB = body.v_WB - g_G * dt - there.T_WB.R * motion.deltas().dv;
  there.T_WB.t =
      body.T_WB.t - there.v_WB * dt - 0.5 * dt * dt * g_G - there.T_WB.R * motion.deltas().dp;
  return there;
}

/** The angular rate around t, rad/s: mean over 10 ms, as a single sample has its noise. */
Vector3d rateAt(const ImuBuffer& imu, TimeNs t, const Vector3d& bias) {
  const TimeNs half = durationNs(0.005);
  const auto samples = imu.between(t - half, t + half);
  if (samples.size() < 2) return Vector3d::Zero();
  const Preintegration motion(samples, {bias, Vector3d::Zero()}, {});
  return logSO3(motion.deltas().dR) / motion.dt();
}

/** Velocity from the rows about 50 ms before and after; zero across gaps. */
Vector3d velocityFromRows(const std::vector<StampedState>& rows, size_t k) {
  size_t a = k, b = k;
  while (a > 0 && secondsBetween(rows[a].t, rows[k].t) < 0.05) --a;
  while (b + 1 < rows.size() && secondsBetween(rows[k].t, rows[b].t) < 0.05) ++b;
  const double dt = secondsBetween(rows[a].t, rows[b].t);
  return dt > 0.0 && dt < 0.5 ? Vector3d((rows[b].T_WB.t - rows[a].T_WB.t) / dt) : Vector3d::Zero();
}

}  // namespace

FlightModel::FlightModel(const std::vector<StampedState>& rows, const ImuBuffer& imu,
                         const ImuNoiseDensities& data_sheet, double step_s, double row_step_s)
    : imu_(&imu), data_sheet_(data_sheet), step_s_(step_s) {
  // A millisecond of slack: stamps of a regular recording are not regular to the nanosecond.
  const TimeNs step = durationNs(std::max(step_s - 1e-3, 1e-4));
  const TimeNs row_step = durationNs(std::max(row_step_s - 1e-3, 1e-4));
  TimeNs counted = 0;
  for (size_t k = 0; k < rows.size(); ++k) {
    if (!nodes_.empty() && rows[k].t - nodes_.back().body.t < step) continue;
    Node node;
    node.counts = nodes_.empty() || rows[k].t - counted >= row_step ||
                  !known(nodes_.back().body.t, rows[k].t);
    if (node.counts) counted = rows[k].t;
    node.T_GM = rows[k].T_WB;
    node.body = StampedState(rows[k].t, rows[k].T_WB, velocityFromRows(rows, k));
    nodes_.push_back(node);
  }
}

bool FlightModel::known(TimeNs from, TimeNs to) const {
  return imu_->covers(from, to) && imu_->longestGap(from, to) <= kMaxImuGapS;
}

void FlightModel::add(const std::vector<NodeVector>& nodes, const BorderVector& border) {
  for (size_t k = 0; k < nodes_.size(); ++k) {
    Node& node = nodes_[k];
    static_cast<NavState&>(node.body) = node.body.plus(nodes[k].head<15>());
    node.errors += nodes[k].tail<12>().reshaped(3, 4);
  }
  shared_.position_shift_s += border[kPositionShift];
  shared_.rotation_shift_s += border[kRotationShift];
  shared_.R_BM = shared_.R_BM * expSO3(border.segment<3>(kTurn));
  shared_.lever_B += border.segment<3>(kLever);
  shared_.g_G += border.segment<3>(kGravity);
}

MotionTerm FlightModel::motionTerm(size_t k) const {
  const NavState &a = nodes_[k].body, &b = nodes_[k + 1].body;
  const TimeNs t0 = nodes_[k].body.t, t1 = nodes_[k + 1].body.t;
  MotionTerm term;
  term.dt = secondsBetween(t0, t1);
  term.known = known(t0, t1);
  if (!term.known) return term;
  const auto samples = imu_->between(t0, t1);
  const ImuNoiseDensities none{0.0, 0.0, 0.0, 0.0};
  for (int source = 0; source < kImuSources; ++source) {
    ImuNoiseDensities one = none;
    if (source == kGyroNoise) one.gyro_noise_density = data_sheet_.gyro_noise_density;
    if (source == kGyroWalk) one.gyro_random_walk = data_sheet_.gyro_random_walk;
    if (source == kAccelNoise) one.accel_noise_density = data_sheet_.accel_noise_density;
    if (source == kAccelWalk) one.accel_random_walk = data_sheet_.accel_random_walk;
    const Preintegration imu(samples, a.bias, one);
    term.covariance[source] = imu.covariance();
    if (source > 0) continue;
    term.residual = inertialResidual(imu, a, b, shared_.g_G, &term.J_this, &term.J_next);
    const Matrix3d R_BG = a.T_WB.R.transpose();
    term.J_gravity.setZero();
    term.J_gravity.middleRows<3>(ix::kPosition) = -0.5 * term.dt * term.dt * R_BG;
    term.J_gravity.middleRows<3>(ix::kVelocity) = -term.dt * R_BG;
  }
  return term;
}

void FlightModel::setOffsets(size_t k, Linearisation* linear) const {
  const StampedState& body = nodes_[k].body;
  const Eigen::Index column = static_cast<Eigen::Index>(k);
  const NavState seen = carried(*imu_, body, body.t, shared_.position_shift_s, shared_.g_G);
  auto position = linear->position_offset.col(column);
  const Vector3d rate =
      rateAt(*imu_, body.t + durationNs(shared_.position_shift_s), body.bias.gyro);
  position.head<3>() = seen.T_WB * shared_.lever_B - body.T_WB.t;
  position.segment<3>(3 * (1 + kPositionShift)) =
      seen.v_WB + seen.T_WB.R * rate.cross(shared_.lever_B);
  for (int i = 0; i < 3; ++i) position.segment<3>(3 * (1 + kLever + i)) = seen.T_WB.R.col(i);

  const TimeNs t_r = body.t + durationNs(shared_.rotation_shift_s);
  const Matrix3d R = carried(*imu_, body, body.t, shared_.rotation_shift_s, shared_.g_G).T_WB.R;
  auto rotation = linear->rotation_offset.col(column);
  const Vector3d offset = logSO3(R * shared_.R_BM * body.T_WB.R.transpose());
  const Matrix3d J = rightJacobianInverseSO3(-offset);
  rotation.head<3>() = offset;
  rotation.segment<3>(3 * (1 + kRotationShift)) = J * R * rateAt(*imu_, t_r, body.bias.gyro);
  for (int i = 0; i < 3; ++i)
    rotation.segment<3>(3 * (1 + kTurn + i)) = J * R * shared_.R_BM.col(i);
}

std::vector<RowTerm> Linearisation::rows(double position_hz, double rotation_hz) const {
  const Eigen::MatrixXd seen_p = lowPassed(position_offset, stretches, step_s, position_hz, 2);
  const Eigen::MatrixXd seen_r = lowPassed(rotation_offset, stretches, step_s, rotation_hz, 1);
  std::vector<RowTerm> terms(nodes.size());
  for (size_t k = 0; k < nodes.size(); ++k) {
    const Node& node = nodes[k];
    const SE3& T_GB = node.body.T_WB;
    const Eigen::Index column = static_cast<Eigen::Index>(k);
    using Derivatives = Eigen::Map<const Eigen::Matrix<double, 3, kBorderSize>>;
    RowTerm& term = terms[k];
    term.position = node.T_GM.t - T_GB.t - seen_p.col(column).head<3>() - node.errors.col(0);
    term.G_position = -Derivatives(seen_p.col(column).data() + 3);
    // How the offsets depend on the body, but for the low pass: errors of the body are slow.
    term.J_position.setZero();
    term.J_position.middleCols<3>(ix::kRotation) = T_GB.R * hat(shared.lever_B);
    term.J_position.middleCols<3>(ix::kPosition) = -Matrix3d::Identity();
    term.J_position.middleCols<3>(ix::kVelocity) = -shared.position_shift_s * Matrix3d::Identity();
    term.J_position.middleCols<3>(kPositionError) = -Matrix3d::Identity();

    // Log((R_GM Exp(error))^T row): what stands left of the error perturbs it from the left.
    const Vector3d offset = seen_r.col(column).head<3>();
    const Matrix3d R_GM = expSO3(offset) * T_GB.R;
    const Matrix3d R_error = expSO3(node.errors.col(2));
    term.rotation = logSO3(R_error.transpose() * R_GM.transpose() * node.T_GM.R);
    const Matrix3d J_left = rightJacobianInverseSO3(-term.rotation);
    const Matrix3d J_M = J_left * R_error.transpose();
    term.G_rotation = -J_M * R_GM.transpose() * rightJacobianSO3(-offset) *
                      Derivatives(seen_r.col(column).data() + 3);
    term.J_rotation.setZero();
    term.J_rotation.middleCols<3>(ix::kRotation) = -J_M * R_GM.transpose() * T_GB.R;
    term.J_rotation.middleCols<3>(ix::kGyroBias) =
        shared.rotation_shift_s * J_M * R_GM.transpose() * T_GB.R;
    term.J_rotation.middleCols<3>(kRotationError) = -J_left * rightJacobianSO3(node.errors.col(2));
  }
  return terms;
}

Linearisation FlightModel::linearise() const {
  Linearisation linear;
  linear.nodes = nodes_;
  linear.shared = shared_;
  linear.motions.reserve(nodes_.size());
  linear.step_s = step_s_;
  linear.position_offset.setZero(kOffsetRows, static_cast<Eigen::Index>(nodes_.size()));
  linear.rotation_offset = linear.position_offset;
  for (size_t k = 0; k < nodes_.size(); ++k) {
    setOffsets(k, &linear);
    if (k == 0 || secondsBetween(nodes_[k - 1].body.t, nodes_[k].body.t) > kGapSteps * step_s_)
      linear.stretches.push_back(static_cast<Eigen::Index>(k));
    if (k + 1 < nodes_.size()) linear.motions.push_back(motionTerm(k));
  }
  return linear;
}

}  // namespace etalon::ground_truth
