#pragma once

namespace etalon {

/** Sum of squared whitened residuals, and what is expected of it if the noise is believed right. */
struct ResidualGroup {
  double chi2 = 0.0;
  /** Number of residuals less what the fit takes out of them: trace of (I - H) over the group, with
   * H the hat matrix of the whitened problem. */
  double dof = 0.0;

  ResidualGroup& operator+=(const ResidualGroup& other) {
    chi2 += other.chi2;
    dof += other.dof;
    return *this;
  }
};

/** Residuals of a visual-inertial estimate by the sensor that they speak of. Sums over windows. */
struct NoiseCheck {
  ResidualGroup gyro, accel, vision;

  NoiseCheck& operator+=(const NoiseCheck& other) {
    gyro += other.gyro;
    accel += other.accel;
    vision += other.vision;
    return *this;
  }
};

}  // namespace etalon
