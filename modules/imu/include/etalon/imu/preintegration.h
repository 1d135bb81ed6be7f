#pragma once

#include <Eigen/Core>
#include <vector>

#include "etalon/core/calibration.h"
#include "etalon/core/nav_state.h"
#include "etalon/imu/imu_sample.h"

namespace etalon {

/**
 * On-manifold preintegration of IMU samples between two instants (Forster et al., TRO 2017),
 * midpoint rule.
 *
 * With biases (b_g, b_a), frames B0 and B1 at the two ends, duration dt and gravity g_W:
 *   R_WB1 = R_WB0 dR,   v_WB1 = v_WB0 + g_W dt + R_WB0 dv,
 *   p_WB1 = p_WB0 + v_WB0 dt + g_W dt^2 / 2 + R_WB0 dp.
 *
 * The covariance and the bias Jacobians belong to the biases of the integration, `bias()`;
 * `corrected()` moves the deltas to other biases to first order, `reintegrated()` integrates the
 * raw samples anew.
 *
 * Between samples the rate is the mean of its two ends and the acceleration, rotated into B0, is
 * linear; the error is of second order in the step. A white noise of density sigma contributes
 * sigma^2 dt to the variance of its integral, whatever the sampling: neighbouring intervals may be
 * treated as independent although they share a sample.
 *
 * Error state: right perturbation dR Exp(d), additive for dp, dv, b_g, b_a, in the order of
 * state_index.
 */
class Preintegration {
 public:
  struct Deltas {
    Eigen::Matrix3d dR = Eigen::Matrix3d::Identity();
    Eigen::Vector3d dv = Eigen::Vector3d::Zero();  ///< m/s
    Eigen::Vector3d dp = Eigen::Vector3d::Zero();  ///< m
  };

  Preintegration() = default;

  /**
   * @param samples what ImuBuffer::between returns: at least two, strictly increasing, both ends
   * @throws DataError if there are fewer, if they are out of order, or if one is not finite
   */
  Preintegration(std::vector<ImuSample> samples, const ImuBias& bias,
                 const ImuNoiseDensities& noise);

  TimeNs start() const { return samples_.empty() ? 0 : samples_.front().t; }
  TimeNs end() const { return samples_.empty() ? 0 : samples_.back().t; }
  double dt() const { return secondsBetween(start(), end()); }  ///< s

  const ImuBias& bias() const { return bias_; }
  const Deltas& deltas() const { return deltas_; }
  const std::vector<ImuSample>& samples() const { return samples_; }
  const ImuNoiseDensities& noise() const { return noise_; }

  /** Deltas at other biases, to first order in the difference (dR through Exp). */
  Deltas corrected(const ImuBias& bias) const;

  /** The state at the end of the interval according to the IMU, from the state at its start. The
   * biases stay as they are. */
  NavState predict(const NavState& start, const Eigen::Vector3d& g_W) const;

  /** Integrated anew from the raw samples. */
  Preintegration reintegrated(const ImuBias& bias) const;

  /** Covariance, 15x15, of the error state at the end; the biases start exactly known. */
  const Eigen::Matrix<double, 15, 15>& covariance() const { return covariance_; }
  /** Its first 9 rows and columns [rotation, position, velocity], bias random walks included. */
  Eigen::Matrix<double, 9, 9> covariance9() const { return covariance_.topLeftCorner<9, 9>(); }

  const Eigen::Matrix3d& dR_dbg() const { return dR_dbg_; }  ///< dR(b_g + d) = dR Exp(dR_dbg d)
  const Eigen::Matrix3d& dv_dbg() const { return dv_dbg_; }
  const Eigen::Matrix3d& dv_dba() const { return dv_dba_; }
  const Eigen::Matrix3d& dp_dbg() const { return dp_dbg_; }
  const Eigen::Matrix3d& dp_dba() const { return dp_dba_; }

 private:
  void integrate();

  std::vector<ImuSample> samples_;
  ImuBias bias_;
  ImuNoiseDensities noise_;
  Deltas deltas_;
  Eigen::Matrix<double, 15, 15> covariance_ = Eigen::Matrix<double, 15, 15>::Zero();
  Eigen::Matrix3d dR_dbg_ = Eigen::Matrix3d::Zero();
  Eigen::Matrix3d dv_dbg_ = Eigen::Matrix3d::Zero();
  Eigen::Matrix3d dv_dba_ = Eigen::Matrix3d::Zero();
  Eigen::Matrix3d dp_dbg_ = Eigen::Matrix3d::Zero();
  Eigen::Matrix3d dp_dba_ = Eigen::Matrix3d::Zero();
};

}  // namespace etalon
