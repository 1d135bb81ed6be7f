#include <algorithm>
#include <cmath>

#include "closed_form_motion.h"
#include "etalon/core/angles.h"
#include "etalon/core/so3.h"
#include "etalon/core/stopwatch.h"
#include "etalon/initialization/initializer.h"
#include "etalon/initialization/steps/gravity_alignment.h"
#include "etalon/initialization/steps/track_information.h"
#include "etalon/optimization/solver_summary.h"
#include "joint_system.h"

namespace etalon::plugins {

using Eigen::Index;
using Eigen::Matrix3d;
using Eigen::MatrixXd;
using Eigen::Vector3d;
using Eigen::VectorXd;

namespace {

/** The frames that the rows come from, and which of them are keyframes. */
struct Nodes {
  std::vector<const TrackedFrame*> frames;
  std::vector<size_t> keyframes;
};

}  // namespace

/**
 * Velocity, gravity and gyro bias from the tracks and the IMU at once, without visual odometry
 * (Martinelli 2014, Dong-Si and Mourikis 2012, Kaiser et al. 2017; README.md beside this file).
 */
class JointClosedForm : public Initializer {
  DEFINE_MRPT_OBJECT(JointClosedForm, etalon::plugins)

 public:
  void declareParameters(ParameterSet& parameters) override {
    parameters.add("frame_stride", &frame_stride_, {0, 1000},
                   "Rows come from the keyframes and from every n-th frame between them; 0: from "
                   "the keyframes alone.");
    parameters.add("accel_bias", &estimate_accel_bias_, {{"prior", false}, {"estimate", true}},
                   "b_a stays at the mean of its prior (as published: zero), or is an unknown with "
                   "that prior.");
    parameters.add(
        "imu_noise", &imu_noise_,
        "Weight the rows by the noise of the IMU as well; no: the IMU counts as exact (as "
        "published).");
    parameters.add(
        "passes", &max_passes_, {1, 100},
        "Linear solutions, at most; from the second on at the depths, weights and biases "
        "of the last.");
    parameters.add("converged_rps", &converged_, {1e-12, 1.0},
                   "A pass that moves b_g by less is the last, rad/s.");
    parameters.add("chi2_pixel", &chi2_pixel_, {0.1, 1e9},
                   "Squared width of the robust weights of a pixel (2 degrees of freedom, 95 %: "
                   "5.991).");
    parameters.add(
        "chi2_stereo", &chi2_stereo_, {0.1, 1e9},
        "A left and a right pixel that miss each other by a larger squared residual give "
        "no starting depth.");
    parameters.add("min_landmarks", &min_landmarks_, {3, 100000},
                   "Refuse if fewer landmarks of the window have a depth from both cameras.");
    parameters.add("min_inlier_share", &min_inlier_share_, {0.0, 1.0},
                   "Refuse if a smaller share of the measurements agrees with the solution.");
    parameters.add("max_sigma_gravity_deg", &max_sigma_gravity_deg_, {0.0, 180.0},
                   "Refuse if the solution's own standard deviation of the gravity direction is "
                   "larger, deg.");
  }
  bool needsVisualSolution() const override { return false; }

 protected:
  InitializationResult solve(const InitializationProblem& problem) const override {
    Stopwatch watch;
    const Nodes nodes = chooseNodes(problem);
    const VisualWindow window =
        buildVisualWindow(problem.calibration(), nodes.frames, problem.sigmaPx());
    const StereoPoints points = stereoPoints(window, chi2_stereo_);
    TrackInformation tracks(window, std::sqrt(chi2_pixel_));
    JointEstimate estimate;
    estimate.bias = problem.priors().mean;
    std::vector<Preintegration> preintegrations = preintegrate(problem, nodes, estimate.bias);
    estimate.bias.gyro = gyroBiasOfPoints(points, preintegrations, problem.calibration().baseline(),
                                          problem.priors().sigma_gyro_rps);
    for (Preintegration& p : preintegrations) p = p.reintegrated(estimate.bias);
    ClosedFormMotion motion = composeMotion(preintegrations);
    estimate.T_VB = medianPositions(points, rotations(motion));
    tracks.start(points, estimate.T_VB);
    if (tracks.validCount() < min_landmarks_)
      return refuse(RefusalStatus::kTooFewTracks, Value(tracks.validCount()),
                    " landmarks of the window have a depth from both cameras, at least ",
                    Bound(min_landmarks_), " are wanted");
    const double force = motion.nodes.back().beta.norm() / motion.nodes.back().t;
    const double least_force = kLeastSpecificForce * problem.gravityMagnitude();
    if (!(force >= least_force))
      return refuse(RefusalStatus::kImplausible, "the accelerometer measures ", Value(force, 3),
                    " m/s^2 on average, which leaves no direction for gravity; at least ",
                    Bound(least_force, 3), " m/s^2 are wanted");
    const double start_ms = watch.lapMilliseconds();

    const SolverSummary summary =
        solvePasses(problem, &tracks, &preintegrations, &motion, &estimate);
    if (summary.termination == Termination::kSingular)
      return refuse(RefusalStatus::kIllConditioned, "the tracks of ", Value(tracks.validCount()),
                    " landmarks do not determine velocity and gravity");
    if (!summary.converged())
      return refuse(RefusalStatus::kNotConverged, Value(max_passes_),
                    " linear solutions did not come to rest");
    tracks.triangulate(estimate.T_VB);
    if (const auto good = check(tracks, estimate); !good) return refuse(good.error());
    Initialization result = makeResult(problem, nodes, window, tracks, estimate);
    // Where the IMU counts as exact, or b_a as known, the errors are not modelled.
    if (imu_noise_ && estimate_accel_bias_) {
      tracks.linearize(estimate.T_VB);
      result.covariance =
          system(problem, motion, tracks, tracks.fisherShare(), estimate).covariance(estimate);
    }
    result.timings = {{"start", start_ms}, {"closed_form", watch.lapMilliseconds()}};
    return result;
  }

 private:
  Nodes chooseNodes(const InitializationProblem& problem) const {
    Nodes nodes;
    const std::vector<int>& keyframes = problem.keyframeIndices();
    for (int i = keyframes.front(); i <= keyframes.back(); ++i) {
      const bool keyframe = std::binary_search(keyframes.begin(), keyframes.end(), i);
      if (keyframe) nodes.keyframes.push_back(nodes.frames.size());
      if (keyframe || (frame_stride_ > 0 && (i - keyframes.front()) % frame_stride_ == 0))
        nodes.frames.push_back(&problem.frames()[i]);
    }
    return nodes;
  }

  static std::vector<Preintegration> preintegrate(const InitializationProblem& problem,
                                                  const Nodes& nodes, const ImuBias& bias) {
    std::vector<Preintegration> result;
    for (size_t k = 1; k < nodes.frames.size(); ++k)
      result.emplace_back(problem.imu().between(nodes.frames[k - 1]->t, nodes.frames[k]->t), bias,
                          problem.imuNoise());
    return result;
  }

  /** Repeats the linear solution until the gyro bias stands still. Costs are not computed. */
  SolverSummary solvePasses(const InitializationProblem& problem, TrackInformation* tracks,
                            std::vector<Preintegration>* preintegrations, ClosedFormMotion* motion,
                            JointEstimate* estimate) const {
    SolverSummary summary;
    summary.termination = Termination::kMaxIterations;
    for (int pass = 0; pass < max_passes_ && !summary.converged(); ++pass) {
      ++summary.iterations;
      // The medians are a rough start, so the first triangulation takes more steps.
      for (int i = 0; i < (pass == 0 ? 3 : 1); ++i) tracks->triangulate(estimate->T_VB);
      tracks->linearize(estimate->T_VB);
      const ImuBias before = estimate->bias;
      if (!system(problem, *motion, *tracks, 1.0, *estimate).solve(estimate)) {
        summary.stop(Termination::kSingular, "the tracks do not determine velocity and gravity");
        return summary;
      }
      const double moved = (estimate->bias.gyro - before.gyro).norm();
      if (moved < converged_ && tracks->nearFinalScale() && pass > 0)
        summary.termination = Termination::kConverged;
      for (Preintegration& p : *preintegrations) p = p.reintegrated(estimate->bias);
      *motion = composeMotion(*preintegrations);
    }
    return summary;
  }

  static std::vector<Matrix3d> rotations(const ClosedFormMotion& motion) {
    std::vector<Matrix3d> result;
    for (const ClosedFormMotion::Node& node : motion.nodes) result.push_back(node.R_VB);
    return result;
  }

  /** @param factor multiplies the tracks' information */
  JointSystem system(const InitializationProblem& problem, const ClosedFormMotion& motion,
                     const TrackInformation& tracks, double factor,
                     const JointEstimate& estimate) const {
    return JointSystem(problem, motion, factor * tracks.S(), factor * tracks.s(), estimate,
                       imu_noise_, estimate_accel_bias_);
  }

  Expected<void> check(const TrackInformation& tracks, const JointEstimate& estimate) const {
    const double sigma_deg = degrees(estimate.sigma_gravity);
    if (!(sigma_deg <= max_sigma_gravity_deg_))
      return refuse(RefusalStatus::kIllConditioned, "the gravity direction is known to ",
                    Value(sigma_deg, 2), " deg (1 sigma), at most ",
                    Bound(max_sigma_gravity_deg_, 2), " is wanted");
    const double share = tracks.inlierShare(kChi2Outlier);
    if (!(share >= min_inlier_share_))
      return refuse(RefusalStatus::kNotConverged, Value(share, 2),
                    " of the measurements agree with the solution, at least ",
                    Bound(min_inlier_share_, 2), " is wanted");
    return {};
  }

  static Initialization makeResult(const InitializationProblem& problem, const Nodes& nodes,
                                   const VisualWindow& window, const TrackInformation& tracks,
                                   const JointEstimate& estimate) {
    VisualFrameEstimate in_V;
    for (const size_t k : nodes.keyframes) {
      in_V.T_VB.push_back(estimate.T_VB[k]);
      in_V.v_VB.push_back(estimate.v_VB[k]);
    }
    in_V.g_V = estimate.g_V;
    in_V.bias = estimate.bias;
    for (size_t l = 0; l < window.landmark_ids.size(); ++l)
      if (tracks.valid()[l]) in_V.landmarks[window.landmark_ids[l]] = tracks.landmarks()[l];
    return alignWithGravity(problem, in_V);
  }

  /** In parts of gravity. A smaller mean specific force does not show where down is. */
  static constexpr double kLeastSpecificForce = 0.1;
  static constexpr double kChi2Outlier = 16.0;  ///< what [odometry] pose_chi2 calls an outlier

  int frame_stride_ = 0;
  bool estimate_accel_bias_ = true;
  bool imu_noise_ = true;
  int max_passes_ = 20;
  double converged_ = 1e-4;
  double chi2_pixel_ = kChi2Pixel;
  double chi2_stereo_ = 16.0;
  int min_landmarks_ = 15;
  double min_inlier_share_ = 0.3;
  double max_sigma_gravity_deg_ = 5.0;
};

IMPLEMENTS_MRPT_OBJECT(JointClosedForm, Initializer, etalon::plugins)

}  // namespace etalon::plugins

ETALON_REGISTER_INITIALIZER(JointClosedForm, etalon::plugins, "joint_closed_form", "1.1",
                            "velocity, gravity and gyro bias from tracks and IMU at once "
                            "(Martinelli, Dong-Si and Mourikis, Kaiser)")
