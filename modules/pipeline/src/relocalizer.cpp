#include "etalon/pipeline/relocalizer.h"

#include <Eigen/Cholesky>
#include <Eigen/Geometry>
#include <cmath>

#include "etalon/core/angles.h"
#include "etalon/core/so3.h"

namespace etalon {
namespace {

using Eigen::Matrix4d;
using Eigen::Vector3d;
using Eigen::Vector4d;
using Matrix6d = Eigen::Matrix<double, 6, 6>;

// Of a landmark as the odometry has it: across the ray it is known like a pixel.
constexpr double kSigmaDistance = 0.02;    // share of it
constexpr double kSigmaDirection = 0.001;  // rad

/** Sightings within a second are of the same landmarks, and err alike. */
constexpr double kAlike = 3.0;
/** Of the remembered keyframes, one against the others. */
constexpr double kSigmaPlaceM = 0.005, kSigmaPlaceYaw = radians(0.1);
constexpr double kChi2Same = 18.5;  // 4 degrees of freedom, 99.9 %
constexpr int kMinSightings = 3;
/** Of the visual odometry between loss and start: yaw (rad), position (m). */
const Vector4d kSigmaVisual(0.05, 0.1, 0.1, 0.1);
/** Roll and pitch are those of the remembered world, within the error of a new start. */
constexpr double kSameTilt = radians(3.0);
constexpr double kBetter = 2.0;

/** Of the inverse of a pose, from the pose's; [rotation by right perturbation, position]. */
Matrix6d covarianceOfInverse(const SE3& T, const Matrix6d& covariance) {
  const SE3 inverse = T.inverse();
  Matrix6d J = Matrix6d::Zero();
  J.topLeftCorner<3, 3>() = -T.R;
  J.bottomLeftCorner<3, 3>() = hat(inverse.t);
  J.bottomRightCorner<3, 3>() = -inverse.R;
  return J * covariance * J.transpose();
}

/** From the error [yaw, position] of a world by left perturbation to the error at p, or back. */
Matrix4d errorAt(const Vector3d& p) {
  Matrix4d J = Matrix4d::Identity();
  J.bottomLeftCorner<3, 1>() = Vector3d::UnitZ().cross(p);
  return J;
}

SE3 turnedAboutZ(double yaw, const Vector3d& t) {
  return {Eigen::AngleAxisd(yaw, Vector3d::UnitZ()).toRotationMatrix(), t};
}

}  // namespace

Relocalizer::Relocalizer(const StereoInertialCalibration& calibration, const MapOptions& options,
                         double sigma_px, std::shared_ptr<ImageViews> views)
    : calibration_(calibration),
      places_(calibration, options, sigma_px * options.sigma_factor, std::move(views)) {}

void Relocalizer::lost(const Trajectory& keyframes) {
  places_.remember(keyframes);
  looking_ = false;
}

void Relocalizer::startedAgain(const SE3& T_WB, const Matrix6d& covariance) {
  looking_ = true;
  Eigen::Matrix<double, 4, 6> J = Eigen::Matrix<double, 4, 6>::Zero();
  J.topLeftCorner<1, 3>() = T_WB.R.row(2);
  J.bottomRightCorner<3, 3>().setIdentity();
  prior_ = J * covariance * J.transpose();
  prior_.diagonal() += kSigmaVisual.cwiseAbs2();
  moved_ = false;
  estimate_ = Estimate();
}

bool Relocalizer::fuse(const SE3& T_WW0, const Matrix4d& covariance) {
  const SE3 off = T_WW0 * estimate_.T_WW0.inverse();
  Vector4d d;
  d << aligningYaw(off.R), off.t;
  const Matrix4d information = covariance.llt().solve(Matrix4d::Identity());
  if (estimate_.sightings > 0) {
    const Matrix4d both = covariance + estimate_.information.llt().solve(Matrix4d::Identity());
    if (d.dot(both.llt().solve(d)) > kChi2Same) {
      if (!moved_) estimate_ = {T_WW0, information, 1};
      return false;
    }
  }
  estimate_.information += information;
  const Vector4d step = estimate_.information.llt().solve(information * d);
  estimate_.T_WW0 = turnedAboutZ(step[0], step.tail<3>()) * estimate_.T_WW0;
  return ++estimate_.sightings >= kMinSightings;
}

Matrix4d Relocalizer::covarianceAt(const Vector3d& p_W) const {
  const Matrix4d J = errorAt(p_W);
  return J * estimate_.information.llt().solve(Matrix4d::Identity()) * J.transpose();
}

std::optional<Relocalization> Relocalizer::look(
    const TrackedFrame& frame, const SE3& T_WB,
    const std::map<LandmarkId, Eigen::Vector3d>& landmarks) {
  if (!looking_) return std::nullopt;
  if (estimate_.sightings > 0 && secondsBetween(first_sighting_, frame.t) > kLookS) {
    looking_ = false;
    return std::nullopt;
  }
  const SE3 T_BW = T_WB.inverse();
  std::vector<SeenLandmark> seen;
  for (const Observation& o : frame.observations) {
    const auto known = landmarks.find(o.id);
    if (known != landmarks.end())
      seen.push_back(seenLandmark(calibration_.cameras[0].T_BC, o.id, o.left, T_BW * known->second,
                                  kSigmaDistance, kSigmaDirection));
  }
  const std::optional<Sighting> sighting = places_.look(seen);
  if (!sighting) return std::nullopt;
  const SE3 T_WN = sighting->T_WP * sighting->view.T_NV.inverse();
  // Of the turn from here to there, what is not about z.
  const Eigen::Matrix3d turn = T_WN.R * T_WB.R.transpose();
  if (!(turn(2, 2) > std::cos(kSameTilt))) return std::nullopt;
  const SE3 T_turn = turnedAboutZ(aligningYaw(turn), Vector3d::Zero());
  const SE3 T_WW0(T_turn.R, T_WN.t - T_turn.R * T_WB.t);

  Matrix6d in_place = covarianceOfInverse(sighting->view.T_NV, sighting->view.covariance);
  Eigen::Matrix<double, 4, 6> J = Eigen::Matrix<double, 4, 6>::Zero();
  J.topLeftCorner<1, 3>() = T_WN.R.row(2);
  J.bottomRightCorner<3, 3>() = sighting->T_WP.R;
  Matrix4d at_body = kAlike * J * in_place * J.transpose();
  at_body.diagonal() +=
      Vector4d(kSigmaPlaceYaw, kSigmaPlaceM, kSigmaPlaceM, kSigmaPlaceM).cwiseAbs2();
  if (!moved_) {  // repeating scenes show the same place elsewhere
    Vector4d d;
    d << aligningYaw(turn), T_WN.t - T_WB.t;
    if (d.dot((prior_ + at_body).llt().solve(d)) > kChi2Same) return std::nullopt;
  }
  const Matrix4d back = errorAt(-T_WN.t);
  if (estimate_.sightings == 0) first_sighting_ = frame.t;
  if (!fuse(T_WW0, back * at_body * back.transpose())) return std::nullopt;

  Relocalization found;
  found.place = sighting->place;
  for (const Observation& o : sighting->observations)
    found.recalled.push_back({sighting->place, o});
  const Matrix4d now = covarianceAt((estimate_.T_WW0 * T_WB).t);
  const double yaw = std::sqrt(now(0, 0)),
               position = std::sqrt(now.bottomRightCorner<3, 3>().trace());
  if (moved_ && kBetter * yaw > sigma_yaw_ && kBetter * position > sigma_position_) return found;
  found.moves = true;
  found.T_WW0 = estimate_.T_WW0;
  found.covariance.bottomRightCorner<3, 3>() = now.bottomRightCorner<3, 3>();
  const Vector3d vertical_B = T_WB.R.row(2);
  found.covariance.topLeftCorner<3, 3>() = now(0, 0) * vertical_B * vertical_B.transpose();
  moved_ = true;
  sigma_yaw_ = yaw;
  sigma_position_ = position;
  estimate_.T_WW0 = SE3();
  return found;
}

}  // namespace etalon
