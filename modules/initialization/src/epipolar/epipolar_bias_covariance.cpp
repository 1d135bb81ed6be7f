#include "epipolar/epipolar_bias_covariance.h"

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <Eigen/LU>

namespace etalon {

using Eigen::Matrix3d;
using Eigen::Vector3d;

namespace {

/** Root of the covariance of a unit bearing whose pixel has the standard deviation `sigma_px`. */
Eigen::Matrix<double, 3, 2> bearingNoise(const CameraModel& camera, double sigma_px,
                                         const Vector3d& f) {
  Eigen::Matrix2d pixel_by_xy;
  const auto direction = camera.directionOf(f, &pixel_by_xy);
  if (!direction) return Eigen::Matrix<double, 3, 2>::Zero();  // at the very edge of the lens
  // In the frame M of the direction, f = x / |x| with x = (xy, 1) = f / f.z.
  const Vector3d f_M = direction->R_MC * f;
  const Matrix3d f_by_x =
      direction->R_MC.transpose() * (f_M.z() * (Matrix3d::Identity() - f_M * f_M.transpose()));
  return sigma_px * f_by_x.leftCols<2>() * pixel_by_xy.inverse();
}

}  // namespace

void EpipolarBiasCovariance::add(const EpipolarPair& pair, const Matrix3d& R, const Matrix3d& A,
                                 const std::vector<Matrix3d>& by_interval, bool rotation_only) {
  // Columns t_m with t_m^T N t_m = 1 and t_m^T M t_m = lambda_m, increasing. A match's residuals
  // are t . n for the first, or at rest for all three.
  const Eigen::GeneralizedSelfAdjointEigenSolver<Matrix3d> eigen(pair.moments.normals(R), pair.N);
  const Matrix3d& T = eigen.eigenvectors();
  Matrix3d by_rotation = Matrix3d::Zero();
  for (int m = 0; m < (rotation_only ? 3 : 1); ++m) {
    const Vector3d t = T.col(m);
    // t . (f_i x R Exp(d) f_j) moves by d . (f_j x R^T (t x f_i)); with it the direction t.
    const auto derivative = [&](const EpipolarMatch& match) {
      return Vector3d(match.f_j.cross(R.transpose() * t.cross(match.f_i)));
    };
    Matrix3d direction = Matrix3d::Zero();  // what t moves by R: sum over the other two of T
    if (!rotation_only) {
      for (const EpipolarMatch& match : pair.matches) {
        if (!(match.weight > 0.0)) continue;
        const Vector3d n = match.f_i.cross(R * match.f_j);
        for (int a = 1; a < 3; ++a)
          if (eigen.eigenvalues()(a) > 0.0)
            direction += match.weight * T.col(a).dot(n) / eigen.eigenvalues()(a) * T.col(a) *
                         derivative(match).transpose();
      }
    }
    for (const EpipolarMatch& match : pair.matches) {
      if (!(match.weight > 0.0)) continue;
      const Vector3d n = match.f_i.cross(R * match.f_j);
      const Vector3d c = derivative(match) - direction.transpose() * n;
      const double w = pair.factor * match.weight;
      by_rotation += w * c * c.transpose();
      const Vector3d gradient = w * (A.transpose() * c);
      const auto note = [&](int number, const Vector3d& f, const Vector3d& residual_by_bearing) {
        Observation& o = observations_[number];
        o.camera = pair.camera;
        o.f = f;
        o.by_bearing += gradient * residual_by_bearing.transpose();
      };
      note(match.observation_i, match.f_i, (R * match.f_j).cross(t));
      note(match.observation_j, match.f_j, R.transpose() * t.cross(match.f_i));
    }
  }
  H_ += A.transpose() * by_rotation * A;
  for (int k = pair.i; k < pair.j; ++k)
    by_gyro_[k] += A.transpose() * by_rotation * by_interval[k - pair.i];
}

GyroBiasErrors EpipolarBiasCovariance::errors() const {
  const Matrix3d H_inverse = H_.inverse();
  GyroBiasErrors errors;
  for (const Observation& o : observations_) {
    const Eigen::Matrix<double, 3, 2> B =
        H_inverse * o.by_bearing *
        bearingNoise(calibration_.cameras[o.camera].model, sigma_px_, o.f);
    errors.covariance += B * B.transpose();
  }
  for (const Matrix3d& by_gyro : by_gyro_) errors.by_rotations.emplace_back(-H_inverse * by_gyro);
  return errors;
}

}  // namespace etalon
