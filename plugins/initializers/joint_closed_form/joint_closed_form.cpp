#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <cstdio>

#include "closed_form_motion.h"
#include "etalon/core/so3.h"
#include "etalon/core/stopwatch.h"
#include "etalon/initialization/gravity_alignment.h"
#include "etalon/initialization/initializer.h"
#include "etalon/optimization/gravity_sphere.h"
#include "track_information.h"

namespace etalon::plugins {

using Eigen::Index;
using Eigen::Matrix3d;
using Eigen::MatrixXd;
using Eigen::Vector3d;
using Eigen::VectorXd;

namespace {

/** The unknowns that are left when the landmarks are eliminated; gravity last. */
enum Unknown : Index { kVelocity = 0, kGyroBias = 3, kAccelBias = 6, kGravity = 9, kUnknowns = 12 };
constexpr int kPose = 6;  ///< [rotation, position] of a node

/** Frames that the rows come from, and which of them are the keyframes. */
struct Nodes {
  std::vector<const TrackedFrame*> frames;
  std::vector<size_t> keyframes;
};

/** What is known after a pass. */
struct Estimate {
  ImuBias bias;
  std::vector<SE3> T_VB;       ///< of every node
  std::vector<Vector3d> v_VB;  ///< of every node; empty before the first pass
  Vector3d g_V = Vector3d::Zero();
  double sigma_gravity = 0.0;  ///< of its weakest direction, rad
};

}  // namespace

/**
 * Velocity, gravity and gyro bias from the tracks and the IMU at once, no visual odometry
 * (Martinelli 2014, Dong-Si and Mourikis 2012, Kaiser et al. 2017; README.md beside this file).
 */
class JointClosedForm : public Initializer {
  DEFINE_MRPT_OBJECT(JointClosedForm, etalon::plugins)

 public:
  void declareParameters(ParameterSet& parameters) override {
    parameters.add("frame_stride", &frame_stride_, {0, 1000},
                   "Rows come from the keyframes and from every n-th frame between them; 0: from "
                   "the keyframes alone.");
    parameters.add("accel_bias", &accel_bias_, {"prior", "estimate"},
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
    Estimate estimate;
    estimate.bias = problem.priors().mean;
    std::vector<Preintegration> preintegrations = preintegrate(problem, nodes, estimate.bias);
    ClosedFormMotion motion = composeMotion(preintegrations);
    estimate.T_VB = medianPositions(points, rotations(motion));
    tracks.start(points, estimate.T_VB);
    if (tracks.validCount() < min_landmarks_)
      return InitializationResult::refusal(
          InitializationStatus::kTooFewTracks,
          "%.0f landmarks of the window have a depth from both cameras, at least %.0f "
          "are wanted",
          tracks.validCount(), min_landmarks_);
    const double start_ms = watch.lapMilliseconds();

    bool converged = false;
    for (int pass = 0; pass < max_passes_ && !converged; ++pass) {
      // From the medians the landmarks have farther to go.
      for (int i = 0; i < (pass == 0 ? 3 : 1); ++i) tracks.triangulate(estimate.T_VB);
      tracks.linearize(estimate.T_VB);
      const ImuBias before = estimate.bias;
      if (!solvePass(problem, motion, tracks, &estimate))
        return InitializationResult::refusal(
            InitializationStatus::kIllConditioned,
            "the tracks of %.0f landmarks do not determine velocity and gravity (%.0f)",
            tracks.validCount(), 0.0);
      const double moved = (estimate.bias.gyro - before.gyro).norm();
      converged = moved < converged_ && tracks.nearFinalScale() && pass > 0;
      for (Preintegration& p : preintegrations) p = p.reintegrated(estimate.bias);
      motion = composeMotion(preintegrations);
    }
    if (!converged)
      return InitializationResult::refusal(
          InitializationStatus::kNotConverged,
          "%.0f linear solutions did not come to rest (at most %.0f)", max_passes_, max_passes_);
    tracks.triangulate(estimate.T_VB);
    InitializationResult refusal = check(tracks, estimate);
    if (!refusal.reason.empty()) return refusal;
    InitializationResult result = makeResult(problem, nodes, window, tracks, estimate);
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
        nodes.frames.push_back(&problem.frames()[static_cast<size_t>(i)]);
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

  static std::vector<Matrix3d> rotations(const ClosedFormMotion& motion) {
    std::vector<Matrix3d> result;
    for (const ClosedFormMotion::Node& node : motion.nodes) result.push_back(node.R_VB);
    return result;
  }

  /** The nodes' errors as a linear function of the unknowns: y = J x + c, 9 a node. */
  static void linearMotion(const ClosedFormMotion& motion, const std::vector<SE3>& T_VB,
                           MatrixXd* J, VectorXd* c) {
    const Index n = ClosedFormMotion::kError * (static_cast<Index>(motion.nodes.size()) - 1);
    J->setZero(n, kUnknowns);
    c->setZero(n);
    for (size_t k = 1; k < motion.nodes.size(); ++k) {
      const ClosedFormMotion::Node& node = motion.nodes[k];
      const Index row = ClosedFormMotion::kError * (static_cast<Index>(k) - 1);
      J->block<9, 6>(row, kGyroBias) = node.bias;
      J->block<3, 3>(row + 3, kVelocity).diagonal().setConstant(node.t);
      J->block<3, 3>(row + 3, kGravity).diagonal().setConstant(0.5 * node.t * node.t);
      J->block<3, 3>(row + 6, kVelocity).setIdentity();
      J->block<3, 3>(row + 6, kGravity).diagonal().setConstant(node.t);
      c->segment<3>(row) = logSO3(T_VB[k].R.transpose() * node.R_VB);
      c->segment<3>(row + 3) = node.alpha - T_VB[k].t;
      c->segment<3>(row + 6) = node.beta;
    }
  }

  /** Rows [rotation, position] of every node's [rotation, position, velocity]. */
  static MatrixXd poseRows(const MatrixXd& nine) {
    const Index n = nine.rows() / ClosedFormMotion::kError;
    MatrixXd six(kPose * n, nine.cols());
    for (Index k = 0; k < n; ++k)
      six.middleRows<kPose>(kPose * k) = nine.middleRows<kPose>(ClosedFormMotion::kError * k);
    return six;
  }

  /**
   * One linear solution: the unknowns, with |g| fixed, from the tracks' information S, s and the
   * motion y = J x + c + n, n the IMU's noise of covariance Sigma: minimises
   *   (y - S^-1 s)^T (S^-1 + Sigma)^-1 (y - S^-1 s)  at n = 0,   then n is what is most likely.
   */
  bool solvePass(const InitializationProblem& problem, const ClosedFormMotion& motion,
                 const TrackInformation& tracks, Estimate* estimate) const {
    MatrixXd J9;
    VectorXd c9;
    linearMotion(motion, estimate->T_VB, &J9, &c9);
    const MatrixXd J = poseRows(J9);
    const VectorXd c = poseRows(c9);
    MatrixXd W = tracks.S();
    VectorXd w = tracks.s();
    const MatrixXd noise_y = imu_noise_ ? poseRows(motion.covariance) : MatrixXd();  // 6n x 9n
    Eigen::PartialPivLU<MatrixXd> whitening;
    if (imu_noise_) {  // (S^-1 + Sigma)^-1 = (I + S Sigma)^-1 S, which does not need S^-1
      MatrixXd M = tracks.S() * poseRows(noise_y.transpose());
      M.diagonal().array() += 1.0;
      whitening.compute(M);
      W = whitening.solve(tracks.S());
      w = whitening.solve(tracks.s());
    }
    const BiasPriors& priors = problem.priors();
    MatrixXd H = J.transpose() * W * J;
    VectorXd b = J.transpose() * (w - W * c);
    const double gyro = 1.0 / (priors.sigma_gyro_rps * priors.sigma_gyro_rps);
    // Fixed is a prior so strong that nothing moves it.
    const double accel = accel_bias_ == "estimate"
                             ? 1.0 / (priors.sigma_accel_mps2 * priors.sigma_accel_mps2)
                             : 1e18;
    H.diagonal().segment<3>(kGyroBias).array() += gyro;
    H.diagonal().segment<3>(kAccelBias).array() += accel;
    b.segment<3>(kGyroBias) += gyro * (priors.mean.gyro - estimate->bias.gyro);
    b.segment<3>(kAccelBias) += accel * (priors.mean.accel - estimate->bias.accel);
    H = (0.5 * (H + H.transpose())).eval();
    const NormConstrainedSolution solution = solveNormConstrained(H, b, problem.gravityMagnitude());
    if (!solution.ok) return false;

    VectorXd y9 = J9 * solution.x + c9;
    if (imu_noise_) {
      const VectorXd y = poseRows(y9);
      y9 += noise_y.transpose() * whitening.solve(tracks.s() - tracks.S() * y);
    }
    adopt(solution, y9, estimate);
    return true;
  }

  /** `y9`: the nodes' errors against the poses of `estimate`, velocities as they are. */
  static void adopt(const NormConstrainedSolution& solution, const VectorXd& y9,
                    Estimate* estimate) {
    estimate->bias.gyro += solution.x.segment<3>(kGyroBias);
    estimate->bias.accel += solution.x.segment<3>(kAccelBias);
    estimate->g_V = solution.x.tail<3>();
    estimate->v_VB.assign(1, solution.x.segment<3>(kVelocity));
    for (size_t k = 1; k < estimate->T_VB.size(); ++k) {
      const Index row = ClosedFormMotion::kError * (static_cast<Index>(k) - 1);
      SE3& pose = estimate->T_VB[k];
      pose.R = nearestRotation(pose.R * expSO3(y9.segment<3>(row)));
      pose.t += y9.segment<3>(row + 3);
      estimate->v_VB.emplace_back(y9.segment<3>(row + 6));
    }
    const Eigen::Matrix<double, 3, 2> B = tangentBasis(estimate->g_V);
    const Eigen::Matrix2d information =
        estimate->g_V.squaredNorm() * B.transpose() * solution.A_g * B;
    const double trace = information.trace(), determinant = information.determinant();
    const double least =
        0.5 * (trace - std::sqrt(std::max(0.0, trace * trace - 4.0 * determinant)));
    estimate->sigma_gravity = 1.0 / std::sqrt(std::max(least, 1e-300));
  }

  /** The refusal's reason is empty if the solution is good. */
  InitializationResult check(const TrackInformation& tracks, const Estimate& estimate) const {
    const double sigma_deg = 180.0 / M_PI * estimate.sigma_gravity;
    if (!(sigma_deg <= max_sigma_gravity_deg_))
      return InitializationResult::refusal(
          InitializationStatus::kIllConditioned,
          "the gravity direction is known to %.2f deg (1 sigma), at most %.2f is wanted", sigma_deg,
          max_sigma_gravity_deg_);
    const double share = tracks.inlierShare(kChi2Outlier);
    if (!(share >= min_inlier_share_))
      return InitializationResult::refusal(
          InitializationStatus::kNotConverged,
          "%.2f of the measurements agree with the solution, at least %.2f is wanted", share,
          min_inlier_share_);
    return {};
  }

  static InitializationResult makeResult(const InitializationProblem& problem, const Nodes& nodes,
                                         const VisualWindow& window, const TrackInformation& tracks,
                                         const Estimate& estimate) {
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

  static constexpr double kChi2Outlier = 16.0;  ///< what [odometry] pose_chi2 calls an outlier

  int frame_stride_ = 0;
  std::string accel_bias_ = "estimate";
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

ETALON_REGISTER_INITIALIZER(JointClosedForm, etalon::plugins, "joint_closed_form", "1.0",
                            "velocity, gravity and gyro bias from tracks and IMU at once "
                            "(Martinelli, Dong-Si and Mourikis, Kaiser)")
