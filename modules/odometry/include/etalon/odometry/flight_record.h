#pragma once

#include <deque>
#include <map>
#include <optional>
#include <vector>

#include "etalon/core/calibration.h"
#include "etalon/core/tracked_frame.h"
#include "etalon/core/trajectory.h"
#include "etalon/odometry/odometry.h"
#include "etalon/optimization/bundle/trajectory_ba.h"

namespace etalon {

struct FlightRecordOptions {
  ImuNoiseDensities imu_noise;
  double gravity_mps2 = 9.81;
  double sigma_px = kTrackSigmaPx;
  /** For finalBa(); of a longer flight the newest ones. 0: nothing is kept for it. */
  size_t max_keyframes = 0;
};

/** The bundle adjustment of a whole flight. */
struct FinalFlight {
  TrajectoryBaResult ba;
  Trajectory keyframes;  ///< their poses T_WB
};

/**
 * Remembers the keyframes of a flight, so that the flight can be estimated better once it is over:
 * the last estimate of each before it left the odometry's window and, if asked for, what a bundle
 * adjustment of all of them needs. It never changes what the odometry does.
 */
class FlightRecord {
 public:
  static constexpr size_t kMostLandmarks = 200'000;

  FlightRecord(const StereoInertialCalibration& calibration, const FlightRecordOptions& options);

  /**
   * A frame as Odometry::process() was given it, and what it said of it; in time order.
   * @param stamp of the frame; `frame` has the odometry's time, which no jump of a clock moves
   * @param odometry whose keyframes and landmarks are known better after the frame; null: none
   */
  void add(TimeNs stamp, const TrackedFrame& frame, const std::vector<ImuSample>& imu,
           const OdometryOutput& output, const Odometry* odometry);

  /** The odometry ended; later keyframes are tied to earlier ones by their poses alone. */
  void interrupt();

  /** Landmarks of the last frame were found in older keyframes. */
  void recall(const std::vector<RecalledObservation>& recalled);

  /** Odometry::moveWorld(): of all frames since the odometry ended last. */
  void moveWorld(const SE3& T_WW0);

  /** For flights without end: smoothed poses before `stamp` are no longer wanted. */
  void forgetBefore(TimeNs stamp);

  /** The last known pose of every keyframe, by its stamp. */
  Trajectory smoothed() const;

  /**
   * The flight as its keyframes are known now: what is between follows them (carriedAlong()). What
   * the IMU alone told is bent to end with the pose and the velocity that the next image showed: by
   * a rotation in proportion to the time, as of a gyro bias, and a displacement that is a cubic of
   * it.
   * @param causal poses of all frames, by their stamps
   */
  Trajectory smoothedFlight(const Trajectory& causal) const;

  /** Where every landmark was last known to be, p_W, m; the newest kMostLandmarks. */
  const std::map<LandmarkId, Eigen::Vector3d>& landmarks() const { return landmarks_; }

  /**
   * solveTrajectoryBa() over the keyframes that are kept; a landmark is one where its id is, and
   * where the odometry has found it again, with the same standard deviation. Where the IMU is
   * missing a body that keeps its velocity takes its place, as in the odometry.
   * @param priors of the first keyframe's biases
   * @param calibration the cameras, if they are not as they were given
   */
  FinalFlight finalBa(const BiasPriors& priors, const TrajectoryBaOptions& options = {},
                      const std::optional<StereoInertialCalibration>& calibration = {}) const;

 private:
  struct Keyframe {
    TimeNs stamp = 0;
    NavState state;
    TrackedFrame frame;
    std::vector<ImuSample> imu;         ///< since the keyframe before
    bool imu_missing = false;           ///< or with a gap
    std::vector<Observation> recalled;  ///< landmarks of later keyframes
  };

  /** The last known pose of a keyframe. */
  struct SmoothedPose {
    TimeNs stamp = 0, odometry_time = 0;  ///< the latter is its stamp as the odometry has it
    LandmarkId first_landmark = 0;        ///< the least id that it saw
    SE3 T_WB;
  };

  /** The IMU alone told the poses between two stamps. */
  struct BlindPiece {
    TimeNs from = 0, to = 0;  ///< the last frame that showed a landmark, and the next
    NavState predicted;       ///< at `to`, by the IMU
    NavState seen;            ///< there, with the image
  };

  /** Poses that were told from the first stamp to before the second became T_WW0 T_WB. */
  struct Move {
    TimeNs from = 0, to = 0;
    SE3 T_WW0;
  };

  /** A first frame, and the least id that it saw. */
  struct Beginning {
    TimeNs stamp = 0;
    LandmarkId first_landmark = 0;
  };

  LandmarkId firstLandmark(const TrackedFrame& frame) const;
  void keepLast();
  void noteBlindPiece(TimeNs stamp, const OdometryOutput& output);
  void bendBlindPieces(const Trajectory& causal, Trajectory* smoothed) const;
  void moveAfter(const Recognition& recognition);
  void moveFrom(const Beginning& beginning, const SE3& T_WW0);

  StereoInertialCalibration calibration_;
  FlightRecordOptions options_;
  std::deque<Keyframe> keyframes_;
  std::vector<ImuSample> imu_;  ///< since the last keyframe
  bool imu_missing_ = false;
  std::map<LandmarkId, Eigen::Vector3d> landmarks_;
  std::deque<SmoothedPose> smoothed_;
  std::optional<Keyframe> last_;   ///< the last frame, unless it is kept
  std::optional<TimeNs> seen_at_;  ///< stamp of the last frame that showed a landmark
  bool is_blind_ = false;          ///< since then frames came that showed none
  std::vector<BlindPiece> blind_pieces_;
  std::vector<Move> moves_;
  TimeNs newest_ = 0;
  std::optional<Beginning> beginning_;  ///< of the odometry that runs
};

}  // namespace etalon
