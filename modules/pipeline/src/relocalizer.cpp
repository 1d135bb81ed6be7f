#include "etalon/pipeline/relocalizer.h"

#include <Eigen/Cholesky>
#include <cmath>

#include "etalon/core/angles.h"
#include "etalon/core/symmetric.h"
#include "etalon/core/yaw.h"

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
constexpr double kAlike = 10.0;
/** Of the remembered keyframes, one against the others. */
const Vector4d kSigmaPlace(radians(0.1), 0.005, 0.005, 0.005);
constexpr double kChi2Same = 18.5;  // 4 degrees of freedom, 99.9 %
constexpr int kMinSightings = 3;
constexpr double kAgreeWithinS = 3.0;
/** Of the visual odometry between loss and start: yaw (rad), position (m). */
const Vector4d kSigmaVisual(0.05, 0.1, 0.1, 0.1);
/** Roll and pitch are those of the remembered world, within the error of a new start. */
constexpr double kSameTilt = radians(3.0);
constexpr double kSigmaTiltOfWorlds = radians(0.5);
// When to move the world again, and when no more.
constexpr double kBetter = 2.0;
constexpr double kSureYaw = radians(0.1), kSureM = 0.008;

/** From the error [yaw, position] of a world by left perturbation to the error at p, or back. */
Matrix4d errorAt(const Vector3d& p) {
  Matrix4d J = Matrix4d::Identity();
  J.bottomLeftCorner<3, 1>() = Vector3d::UnitZ().cross(p);
  return J;
}

/** The error [yaw, position in W] from that of a pose, [rotation by right perturbation, position in
 * axes that R_WA turns to W's]. */
Eigen::Matrix<double, 4, 6> yawAndPosition(const Eigen::Matrix3d& R_WB,
                                           const Eigen::Matrix3d& R_WA) {
  Eigen::Matrix<double, 4, 6> J = Eigen::Matrix<double, 4, 6>::Zero();
  J.topLeftCorner<1, 3>() = R_WB.row(2);
  J.bottomRightCorner<3, 3>() = R_WA;
  return J;
}

}  // namespace

Relocalizer::Relocalizer(const StereoInertialCalibration& calibration, const MapOptions& options,
                         double sigma_px, std::shared_ptr<ImageViews> views)
    : calibration_(calibration),
      places_(calibration, options, sigma_px * options.sigma_factor, std::move(views)) {}

void Relocalizer::lost(const Trajectory& keyframes) {
  // Keyframes of a flight that was never recognised are in another world.
  is_elsewhere_ = looking_ && !moved_;
  if (!is_elsewhere_) places_.remember(keyframes);
  looking_ = false;
}

void Relocalizer::startedAgain(const SE3& T_WB, const Matrix6d& covariance) {
  looking_ = true;
  const auto J = yawAndPosition(T_WB.R, Eigen::Matrix3d::Identity());
  if (!is_elsewhere_) prior_.setZero();
  prior_ += J * covariance * J.transpose();
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
    if (squaredMahalanobis(d, both) > kChi2Same) {
      if (!moved_) estimate_ = {T_WW0, information, 1};
      return false;
    }
  }
  estimate_.information += information;
  const Vector4d step = estimate_.information.llt().solve(information * d);
  estimate_.T_WW0 = SE3(turnAboutZ(step[0]), step.tail<3>()) * estimate_.T_WW0;
  return ++estimate_.sightings >= kMinSightings;
}

std::optional<Sighting> Relocalizer::sight(const TrackedFrame& frame, const SE3& T_WB,
                                           const std::map<LandmarkId, Vector3d>& landmarks) {
  const SE3 T_BW = T_WB.inverse();
  std::vector<SeenLandmark> seen;
  for (const Observation& o : frame.observations) {
    const auto known = landmarks.find(o.id);
    if (known != landmarks.end())
      seen.push_back(seenLandmark(calibration_.cameras[0].T_BC, o.id, o.left, T_BW * known->second,
                                  kSigmaDistance, kSigmaDirection));
  }
  if (estimate_.sightings == 0) return places_.look(seen);
  const SE3 guess = estimate_.T_WW0 * T_WB;
  Matrix6d covariance = poseCovariance(guess);
  covariance.diagonal().head<3>().array() += kSigmaTiltOfWorlds * kSigmaTiltOfWorlds;
  return places_.lookNear(guess, covariance, seen);
}

std::optional<Relocalization> Relocalizer::look(const TrackedFrame& frame, const SE3& T_WB,
                                                const std::map<LandmarkId, Vector3d>& landmarks) {
  if (!looking_) return std::nullopt;
  const double since_first =
      estimate_.sightings > 0 ? secondsBetween(first_sighting_, frame.t) : 0.0;
  looking_ = !moved_ || since_first < kLookS;
  if (!looking_) return std::nullopt;
  if (!moved_ && since_first > kAgreeWithinS) estimate_ = Estimate();  // that was another place
  const std::optional<Sighting> sighting = sight(frame, T_WB, landmarks);
  if (!sighting) return std::nullopt;
  const OldView seen_from_place = inverse(sighting->view);
  const SE3 T_WN = sighting->T_WP * seen_from_place.T_NV;
  // Of the turn from here to there, what is not about z.
  const Eigen::Matrix3d turn = T_WN.R * T_WB.R.transpose();
  if (!(turn(2, 2) > std::cos(kSameTilt))) return std::nullopt;
  const SE3 T_WW0 = yawPositionAlignment(T_WB, T_WN);

  const auto J = yawAndPosition(T_WN.R, sighting->T_WP.R);
  Matrix4d covariance = kAlike * J * seen_from_place.covariance * J.transpose();
  covariance.diagonal() += kSigmaPlace.cwiseAbs2();
  if (!moved_) {  // scenes repeat themselves
    Vector4d d;
    d << aligningYaw(turn), T_WN.t - T_WB.t;
    if (squaredMahalanobis(d, prior_ + covariance) > kChi2Same) return std::nullopt;
  }
  const Matrix4d back = errorAt(-T_WN.t);
  const bool believed = fuse(T_WW0, back * covariance * back.transpose());
  if (estimate_.sightings == 1) first_sighting_ = frame.t;
  if (!believed) return std::nullopt;

  Relocalization found;
  found.place = sighting->place;
  for (const Observation& o : sighting->observations)
    found.recalled.push_back({sighting->place, o});
  moveIfBetter(T_WB, &found);
  return found;
}

/** Of the body's pose in the world of before, if it is there in that world. */
Matrix6d Relocalizer::poseCovariance(const SE3& T_WB) const {
  const Matrix4d J = errorAt(T_WB.t);
  const Matrix4d now = J * estimate_.information.llt().solve(Matrix4d::Identity()) * J.transpose();
  const auto from_pose = yawAndPosition(T_WB.R, Eigen::Matrix3d::Identity());
  return from_pose.transpose() * now * from_pose;
}

void Relocalizer::moveIfBetter(const SE3& T_WB, Relocalization* found) {
  found->covariance = poseCovariance(estimate_.T_WW0 * T_WB);
  const double yaw = std::sqrt(found->covariance.topLeftCorner<3, 3>().trace());
  const double position = std::sqrt(found->covariance.bottomRightCorner<3, 3>().trace());
  const bool is_sure = yaw < kSureYaw && position < kSureM;
  if (moved_ && !is_sure && kBetter * yaw > sigma_yaw_ && kBetter * position > sigma_position_)
    return;
  looking_ = !is_sure;
  found->moves = moved_ = true;
  found->T_WW0 = estimate_.T_WW0;
  sigma_yaw_ = yaw;
  sigma_position_ = position;
  estimate_.T_WW0 = SE3();
}

}  // namespace etalon
