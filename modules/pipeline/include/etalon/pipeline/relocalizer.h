#pragma once

#include <map>
#include <memory>
#include <optional>
#include <vector>

#include "etalon/map/place_search.h"
#include "etalon/odometry/odometry.h"

namespace etalon {

/** The odometry, started anew after a loss, sees a place from before the loss. */
struct Relocalization {
  /** From the world that the odometry is in to that of before; it turns about z. */
  SE3 T_WW0;
  /** Of the current pose in the world of before, relative to the place: [rotation, position]. */
  Eigen::Matrix<double, 6, 6> covariance = Eigen::Matrix<double, 6, 6>::Zero();
  TimeNs place = 0;                           ///< stamp of the keyframe, in the odometry's time
  std::vector<RecalledObservation> recalled;  ///< what shows it
  bool moves = false;                         ///< the world is to be moved
};

/**
 * From a loss on it remembers keyframes of before; once the odometry runs again it looks for them.
 * The first sightings are of young landmarks, whose distances are hardly known, so it goes on
 * looking, for kLookS at most: the world moves when three sightings agree with each other and with
 * what the loss may have done, and again whenever further ones have made its place twice as sure.
 */
class Relocalizer {
 public:
  static constexpr double kLookS = 20.0;  ///< after the first sighting

  /** @param views has the images of the odometry's keyframes and of the current frame
   * @param sigma_px of a tracked pixel */
  Relocalizer(const StereoInertialCalibration& calibration, const MapOptions& options,
              double sigma_px, std::shared_ptr<ImageViews> views);

  /** Where the odometry is lost before it was recognised, what is remembered stays as it was.
   * @param keyframes of the odometry that is lost, T_WB */
  void lost(const Trajectory& keyframes);
  /** @param covariance of T_WB in the world of before: [rotation, position], rad and m */
  void startedAgain(const SE3& T_WB, const Eigen::Matrix<double, 6, 6>& covariance);

  /** To be called once a frame while the odometry is lost or isLooking(). */
  void prepare() { places_.prepareOne(); }

  /** To be asked at keyframes.
   * @param landmarks p_W, as the odometry knows them */
  std::optional<Relocalization> look(const TrackedFrame& frame, const SE3& T_WB,
                                     const std::map<LandmarkId, Eigen::Vector3d>& landmarks);

  bool isLooking() const { return looking_; }

 private:
  /** Yaw and position of the world of before against the odometry's, by left perturbation: at p in
   * the world of before they are off by [z x p, 1] times the error. */
  struct Estimate {
    SE3 T_WW0;
    Eigen::Matrix4d information = Eigen::Matrix4d::Zero();
    int sightings = 0;
  };

  bool fuse(const SE3& T_WW0, const Eigen::Matrix4d& covariance);
  std::optional<Sighting> sight(const TrackedFrame& frame, const SE3& T_WB,
                                const std::map<LandmarkId, Eigen::Vector3d>& landmarks);
  Eigen::Matrix<double, 6, 6> poseCovariance(const SE3& T_WB) const;
  void moveIfBetter(const SE3& T_WB, Relocalization* found);

  StereoInertialCalibration calibration_;
  PlaceSearch places_;
  bool looking_ = false;
  bool is_elsewhere_ = false;  ///< lost again before the odometry was recognised
  /** Covariance of yaw and position when the odometry started again, rad and m. */
  Eigen::Matrix4d prior_ = Eigen::Matrix4d::Zero();
  TimeNs first_sighting_ = 0;
  Estimate estimate_;
  bool moved_ = false;
  double sigma_yaw_ = 0.0, sigma_position_ = 0.0;  ///< when the world moved last
};

}  // namespace etalon
