#include "etalon/imu/preintegration.h"

#include <Eigen/Geometry>
#include <cmath>
#include <string>
#include <utility>

#include "etalon/core/errors.h"
#include "etalon/core/so3.h"

namespace etalon {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;
namespace ix = state_index;

/** What the forward pass leaves at sample k; B0 is the body at the start. */
struct Node {
  Matrix3d dR;     // B_k to B0
  Vector3d accel;  // dR_k (a_k - b_a), m/s^2, in B0
  Matrix3d
      phi_bg;  // of the step k to k+1: rotation error in B0 per gyro bias, -dR_{k+1} Jr(w dt) dt
  double dt;   // of the step k to k+1, s; zero at the last sample
};

/**
 * Responses of the state at the end to what happens at sample k, accumulated from the end to the
 * start.
 *
 * Rotation errors phi are taken in B0, dR = Exp(phi) dR_hat: between impulses they stay constant,
 * and an acceleration dR a in B0 changes by -hat(dR a) phi. The responses to phi are then the
 * deltas of the rest of the interval, velocity: -hat(dv),   position: -hat(dp), so that one
 * accumulation yields deltas, bias Jacobians and covariance. Each member belongs to [t_k, t_end].
 */
struct Responses {
  double dt = 0.0;                     // s
  Vector3d dv = Vector3d::Zero();      // v_end - v_k, m/s
  Vector3d dp = Vector3d::Zero();      // p_end - p_k - v_k dt, m
  Matrix3d phi_bg = Matrix3d::Zero();  // to a gyro bias that acts from t_k on
  Matrix3d dv_bg = Matrix3d::Zero();
  Matrix3d dp_bg = Matrix3d::Zero();
  Matrix3d dv_ba = Matrix3d::Zero();  // to an accelerometer bias that acts from t_k on
  Matrix3d dp_ba = Matrix3d::Zero();

  /**
   * Puts the step from sample a to sample b in front. The acceleration in B0 is linear over the
   * step: v_b - v_a = (A_a + A_b) dt / 2,   p_b - p_a - v_a dt = (2 A_a + A_b) dt^2 / 6.
   */
  void prepend(const Node& a, const Node& b) {
    const double h = a.dt;
    const double h2_6 = h * h / 6.0;
    // phi_bg of the step acts on A_b within the step and on everything after it.
    dv_bg.noalias() -= hat(dv + 0.5 * h * b.accel) * a.phi_bg;
    dp_bg.noalias() -= hat(dp + (0.5 * h * dt + h2_6) * b.accel) * a.phi_bg;
    phi_bg += a.phi_bg;

    const Vector3d step_dv = 0.5 * h * (a.accel + b.accel);
    dp += dt * step_dv + h2_6 * (2.0 * a.accel + b.accel);
    dv += step_dv;
    const Matrix3d step_dv_ba = -0.5 * h * (a.dR + b.dR);
    dp_ba += dt * step_dv_ba - h2_6 * (2.0 * a.dR + b.dR);
    dv_ba += step_dv_ba;
    dt += h;
  }
};

/**
 * The white noises of the continuous-time model turned into the covariance at the end, P = integral
 * of G Q G^T dt with the responses G above; the one place of the discretisation. The integral is a
 * trapezoidal sum over the samples: neighbouring midpoint steps share a sample, so noise is counted
 * once per sample, which stands for half of the steps on its two sides (density^2 * weight, weights
 * summing to the interval).
 */
class CovarianceSum {
 public:
  explicit CovarianceSum(const ImuNoiseDensities& noise)
      : gyro2_(noise.gyro_noise_density * noise.gyro_noise_density),
        gyro_walk2_(noise.gyro_random_walk * noise.gyro_random_walk),
        accel2_(noise.accel_noise_density * noise.accel_noise_density),
        accel_walk2_(noise.accel_random_walk * noise.accel_random_walk) {}

  void add(const Responses& r, double weight_s) {
    addGyroNoise(r, gyro2_ * weight_s);
    // Steps of the biases: what they do to [rotation, position, velocity].
    const Matrix3d walk = gyro_walk2_ * weight_s * r.phi_bg.transpose();
    addProduct(r.phi_bg, walk, 0, 0);
    addProduct(r.dp_bg, walk, 3, 0);
    addProduct(r.dv_bg, walk, 6, 0);
    addOfTranslation(r.dp_bg, r.dv_bg, gyro_walk2_ * weight_s);
    addOfTranslation(r.dp_ba, r.dv_ba, accel_walk2_ * weight_s);
    gyro_bias_.topRows<3>() += weight_s * r.phi_bg;
    gyro_bias_.middleRows<3>(3) += weight_s * r.dp_bg;
    gyro_bias_.bottomRows<3>() += weight_s * r.dv_bg;
    accel_bias_.topRows<3>() += weight_s * r.dp_ba;
    accel_bias_.bottomRows<3>() += weight_s * r.dv_ba;
  }

  /**
   * What a saturated sample did not show, as white noise of its axes: as large as an error of
   * kOvershoot times the measured value that holds for kOvershootS.
   */
  void addOvershoot(const Responses& r, const Matrix3d& dR, const ImuSample& sample,
                    double weight_s) {
    constexpr double kOvershoot = 0.5, kOvershootS = 0.1;
    for (int axis = 0; axis < 3; ++axis) {
      const Vector3d along = dR.col(axis);
      const auto add = [&](double value, const Vector3d& phi, const Vector3d& dp,
                           const Vector3d& dv) {
        Eigen::Matrix<double, 9, 1> G;
        G << phi, dp, dv;
        const double q = kOvershoot * kOvershoot * value * value * kOvershootS * weight_s;
        navigation_.noalias() += q * G * G.transpose();
      };
      if (sample.saturated & saturatedGyro(axis))
        add(sample.gyro[axis], along, -r.dp.cross(along), -r.dv.cross(along));
      if (sample.saturated & saturatedAccel(axis))
        add(sample.accel[axis], Vector3d::Zero(), r.dt * along, along);
    }
  }

  /** P in the order of state_index, the rotation error moved from B0 to the body at the end. */
  Eigen::Matrix<double, 15, 15> total(const Matrix3d& dR, double dt) const {
    Eigen::Matrix<double, 15, 15> P = Eigen::Matrix<double, 15, 15>::Zero();
    P.topLeftCorner<9, 9>() = navigation_.selfadjointView<Eigen::Lower>();
    // Accelerometer noise is isotropic and so the same in B0: its double integral is known in
    // closed form.
    P.block<3, 3>(ix::kVelocity, ix::kVelocity).diagonal().array() += accel2_ * dt;
    P.block<3, 3>(ix::kPosition, ix::kVelocity).diagonal().array() += accel2_ * dt * dt / 2.0;
    P.block<3, 3>(ix::kVelocity, ix::kPosition).diagonal().array() += accel2_ * dt * dt / 2.0;
    P.block<3, 3>(ix::kPosition, ix::kPosition).diagonal().array() += accel2_ * dt * dt * dt / 3.0;
    P.block<9, 3>(0, ix::kGyroBias) = gyro_walk2_ * gyro_bias_;
    P.block<6, 3>(ix::kPosition, ix::kAccelBias) = accel_walk2_ * accel_bias_;
    P.block<3, 3>(ix::kGyroBias, ix::kGyroBias).diagonal().setConstant(gyro_walk2_ * dt);
    P.block<3, 3>(ix::kAccelBias, ix::kAccelBias).diagonal().setConstant(accel_walk2_ * dt);
    P.bottomLeftCorner<6, 9>() = P.topRightCorner<9, 6>().transpose();
    P.topRows<3>() = (dR.transpose() * P.topRows<3>()).eval();
    P.leftCols<3>() = (P.leftCols<3>() * dR).eval();
    return 0.5 * (P + P.transpose());  // symmetric to the last bit
  }

 private:
  /** Adds q G G^T with G = [I; -hat(dp); -hat(dv)]. */
  void addGyroNoise(const Responses& r, double q) {
    navigation_.block<3, 3>(0, 0).diagonal().array() += q;
    navigation_.block<3, 3>(3, 0) -= q * hat(r.dp);
    navigation_.block<3, 3>(6, 0) -= q * hat(r.dv);
    addHatProduct(r.dp, r.dp, q, 3, 3);
    addHatProduct(r.dv, r.dp, q, 6, 3);
    addHatProduct(r.dv, r.dv, q, 6, 6);
  }

  /** Adds q hat(a) hat(b)^T = q ((a . b) I - b a^T). */
  void addHatProduct(const Vector3d& a, const Vector3d& b, double q, int row, int column) {
    auto block = navigation_.block<3, 3>(row, column);
    block.noalias() -= (q * b) * a.transpose();
    block.diagonal().array() += q * a.dot(b);
  }

  /** Adds q G G^T with G = [0; dp; dv]. */
  void addOfTranslation(const Matrix3d& dp, const Matrix3d& dv, double q) {
    const Matrix3d by_dp = q * dp.transpose();
    addProduct(dp, by_dp, 3, 3);
    addProduct(dv, by_dp, 6, 3);
    addProduct(dv, q * dv.transpose(), 6, 6);
  }

  void addProduct(const Matrix3d& a, const Matrix3d& b, int row, int column) {
    navigation_.block<3, 3>(row, column).noalias() += a.lazyProduct(b);
  }

  double gyro2_, gyro_walk2_, accel2_, accel_walk2_;
  /** Of [rotation, position, velocity]; the blocks on and below the diagonal count. */
  Eigen::Matrix<double, 9, 9> navigation_ = Eigen::Matrix<double, 9, 9>::Zero();
  Eigen::Matrix<double, 9, 3> gyro_bias_ = Eigen::Matrix<double, 9, 3>::Zero();
  Eigen::Matrix<double, 6, 3> accel_bias_ = Eigen::Matrix<double, 6, 3>::Zero();
};

void validate(const std::vector<ImuSample>& samples) {
  if (samples.size() < 2)
    throw DataError("", 0,
                    "preintegration got " + std::to_string(samples.size()) +
                        " IMU sample(s); expected at least the two at the ends of the interval");
  for (size_t k = 0; k < samples.size(); ++k) {
    const ImuSample& s = samples[k];
    if (!s.gyro.allFinite() || !s.accel.allFinite())
      throw DataError("", 0,
                      "IMU sample at " + std::to_string(s.t) +
                          " ns is not finite; expected finite rates and accelerations");
    if (k > 0 && s.t <= samples[k - 1].t)
      throw DataError("", 0,
                      "IMU samples out of order: stamp " + std::to_string(s.t) + " ns follows " +
                          std::to_string(samples[k - 1].t) +
                          " ns; expected strictly increasing stamps");
  }
}

/** Rotations by the mean rate of each step, and what the backward pass needs at every sample. */
std::vector<Node> integrateRotations(const std::vector<ImuSample>& samples, const ImuBias& bias) {
  std::vector<Node> nodes(samples.size());
  Matrix3d dR = Matrix3d::Identity();
  for (size_t k = 0; k < samples.size(); ++k) {
    Node& node = nodes[k];
    node.dR = dR;
    node.accel.noalias() = dR * (samples[k].accel - bias.accel);
    node.dt = 0.0;
    if (k + 1 == samples.size()) break;
    node.dt = secondsBetween(samples[k].t, samples[k + 1].t);
    const Vector3d angle =
        (0.5 * (samples[k].gyro + samples[k + 1].gyro) - bias.gyro) * node.dt;  // rad
    dR = node.dR * expSO3(angle);
    node.phi_bg.noalias() = (-node.dt * dR) * rightJacobianSO3(angle);
  }
  return nodes;
}

}  // namespace

Preintegration::Preintegration(std::vector<ImuSample> samples, const ImuBias& bias,
                               const ImuNoiseDensities& noise)
    : samples_(std::move(samples)), bias_(bias), noise_(noise) {
  validate(samples_);
  integrate();
}

void Preintegration::integrate() {
  const std::vector<Node> nodes = integrateRotations(samples_, bias_);
  Responses responses;
  CovarianceSum covariance(noise_);
  const auto addSample = [&](size_t k, double weight_s) {
    covariance.add(responses, weight_s);
    if (samples_[k].saturated)
      covariance.addOvershoot(responses, nodes[k].dR, samples_[k], weight_s);
  };
  addSample(nodes.size() - 1, 0.5 * nodes[nodes.size() - 2].dt);
  for (size_t k = nodes.size() - 1; k-- > 0;) {
    responses.prepend(nodes[k], nodes[k + 1]);
    const double before = k > 0 ? nodes[k - 1].dt : 0.0;
    addSample(k, 0.5 * (before + nodes[k].dt));
  }
  deltas_ = {nodes.back().dR, responses.dv, responses.dp};
  covariance_ = covariance.total(deltas_.dR, responses.dt);
  dR_dbg_ = deltas_.dR.transpose() * responses.phi_bg;
  dv_dbg_ = responses.dv_bg;
  dv_dba_ = responses.dv_ba;
  dp_dbg_ = responses.dp_bg;
  dp_dba_ = responses.dp_ba;
}

Preintegration::Deltas Preintegration::corrected(const ImuBias& bias) const {
  const Vector3d d_bg = bias.gyro - bias_.gyro;
  const Vector3d d_ba = bias.accel - bias_.accel;
  return {deltas_.dR * expSO3(dR_dbg_ * d_bg), deltas_.dv + dv_dbg_ * d_bg + dv_dba_ * d_ba,
          deltas_.dp + dp_dbg_ * d_bg + dp_dba_ * d_ba};
}

NavState Preintegration::predict(const NavState& start, const Eigen::Vector3d& g_W) const {
  const Deltas d = corrected(start.bias);
  NavState end = start;
  end.T_WB.R = nearestRotation(start.T_WB.R * d.dR);
  end.T_WB.t += start.v_WB * dt() + 0.5 * dt() * dt() * g_W + start.T_WB.R * d.dp;
  end.v_WB += g_W * dt() + start.T_WB.R * d.dv;
  return end;
}

Preintegration Preintegration::reintegrated(const ImuBias& bias) const {
  return Preintegration(samples_, bias, noise_);
}

}  // namespace etalon
