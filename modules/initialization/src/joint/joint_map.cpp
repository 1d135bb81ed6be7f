#include "etalon/initialization/joint/joint_map.h"

#include <algorithm>
#include <cmath>

#include "etalon/core/stopwatch.h"
#include "etalon/initialization/estimation_error.h"
#include "etalon/initialization/predicted_errors.h"
#include "etalon/initialization/steps/gravity_alignment.h"
#include "etalon/initialization/steps/track_information.h"
#include "etalon/optimization/solver_summary.h"

namespace etalon {

using Eigen::Matrix3d;

void JointMapOptions::declare(ParameterSet& parameters) {
  parameters.add("frame_stride", &frame_stride, {0, 1000},
                 "Rows come from the keyframes and from every n-th frame between them; 0: from "
                 "the keyframes alone.");
  parameters.add("passes", &max_passes, {2, 100},
                 "Linear solutions, at most; from the second on at the depths, weights and biases "
                 "of the last.");
  parameters.add("converged_rps", &converged_rps, {1e-12, 1.0},
                 "A pass that moves b_g by less is the last, rad/s.");
  parameters.add("chi2_pixel", &chi2_pixel, {1.0, 1e9},
                 "Squared width of the robust weights of a pixel (2 degrees of freedom, 95 %: "
                 "5.991).");
  parameters.add("chi2_stereo", &chi2_stereo, {0.1, 1e9},
                 "A left and a right pixel that miss each other by a larger squared residual give "
                 "no starting depth.");
  parameters.add("min_landmarks", &min_landmarks, {3, 100000},
                 "Refuse if fewer landmarks of the window have a depth from both cameras.");
  parameters.add("min_inlier_share", &min_inlier_share, {0.0, 1.0},
                 "Refuse if a smaller share of the measurements agrees with the solution.");
  parameters.add("max_sigma_gravity_deg", &max_sigma_gravity_deg, {0.0, 180.0},
                 "Refuse if the solution's own standard deviation of the gravity direction is "
                 "larger, deg.");
}

namespace {

/** Frames that the rows come from, and which of them are the keyframes. */
struct Nodes {
  std::vector<const TrackedFrame*> frames;
  std::vector<size_t> keyframes;
};

constexpr double kChi2Outlier = 16.0;  ///< what [odometry] pose_chi2 calls an outlier

Nodes chooseNodes(const InitializationProblem& problem, int frame_stride) {
  Nodes nodes;
  const std::vector<int>& keyframes = problem.keyframeIndices();
  for (int i = keyframes.front(); i <= keyframes.back(); ++i) {
    const bool keyframe = std::binary_search(keyframes.begin(), keyframes.end(), i);
    if (keyframe) nodes.keyframes.push_back(nodes.frames.size());
    if (keyframe || (frame_stride > 0 && (i - keyframes.front()) % frame_stride == 0))
      nodes.frames.push_back(&problem.frames()[i]);
  }
  return nodes;
}

/** The slow error at its size in the window. */
SlowAcceleration slowAcceleration(const JointModel& model, const JointEstimate& estimate) {
  SlowAcceleration slow = model.slow_accel;
  slow.sigma_mps2 *= estimate.sizes.slow;
  return slow;
}

std::vector<Preintegration> preintegrate(const InitializationProblem& problem, const Nodes& nodes,
                                         const ImuBias& bias, const JointModel& model) {
  std::vector<Preintegration> result;
  const ImuNoiseDensities noise = model.slow_accel.white(problem.imuNoise());
  for (size_t k = 1; k < nodes.frames.size(); ++k)
    result.emplace_back(problem.imu().between(nodes.frames[k - 1]->t, nodes.frames[k]->t), bias,
                        noise);
  return result;
}

std::vector<Matrix3d> rotations(const ClosedFormMotion& motion) {
  std::vector<Matrix3d> result;
  for (const ClosedFormMotion::Node& node : motion.nodes) result.push_back(node.R_VB);
  return result;
}

/** By how much the sizes of the accelerometer's errors have changed, in their logarithms. */
double resized(const AccelErrorSizes& before, const AccelErrorSizes& after) {
  const Eigen::ArrayXd white = after.whiteByInterval().array() / before.whiteByInterval().array();
  return std::max(std::abs(std::log(after.slow / before.slow)), white.log().abs().maxCoeff());
}
constexpr double kSizesAtRest = 0.1;

/** A bias of the gyro that moved less acts to first order; the accelerometer's always does. As
 * VisualInertialBaOptions::reintegrate_gyro_rps. */
constexpr double kFirstOrder = 0.01;  // rad/s

/** Linear solutions until the gyro bias stands still, and how noisy the IMU is. Costs are not
 * computed. */
SolverSummary solvePasses(const InitializationProblem& problem, const JointMapOptions& options,
                          TrackInformation* tracks, std::vector<Preintegration>* preintegrations,
                          ClosedFormMotion* motion, JointEstimate* estimate) {
  SolverSummary summary;
  summary.termination = Termination::kMaxIterations;
  for (int pass = 0; pass < options.max_passes && !summary.converged(); ++pass) {
    ++summary.iterations;
    // From the medians the landmarks have farther to go.
    for (int i = 0; i < (pass == 0 ? 3 : 1); ++i) tracks->triangulate(estimate->T_SS);
    tracks->linearize(estimate->T_SS);
    const JointEstimate before = *estimate;
    const JointSystem system(problem, *motion, tracks->S(), tracks->s(), *estimate, options.model);
    if (!system.solve(estimate)) {
      summary.stop(Termination::kSingular, "the tracks do not determine velocity and gravity");
      return summary;
    }
    const double moved = (estimate->bias.gyro - before.bias.gyro).norm();
    const bool at_rest = moved < options.converged_rps &&
                         estimate->step_sigmas < options.converged_sigmas &&
                         tracks->nearFinalScale() && pass > 0;
    // Sizes that do not settle must not refuse a window whose state has.
    const bool last = pass + 1 == options.max_passes;
    if (at_rest && (last || resized(before.sizes, estimate->sizes) < kSizesAtRest))
      summary.termination = Termination::kConverged;
    if (summary.converged()) break;  // the derivatives no longer change
    for (Preintegration& p : *preintegrations)
      if ((p.bias().gyro - estimate->bias.gyro).norm() > kFirstOrder)
        p = p.reintegrated(estimate->bias);
    *motion = composeMotion(*preintegrations, slowAcceleration(options.model, *estimate),
                            estimate->sizes.whiteByInterval(), estimate->bias);
  }
  return summary;
}

/** Why the passes have not come to rest. */
tl::unexpected<Refusal> notAtRest(const JointMapOptions& options, const TrackInformation& tracks) {
  if (!tracks.nearFinalScale())
    return refuse(RefusalStatus::kNotConverged, "after ", options.max_passes,
                  " linear solutions the pixels' residuals are ", Value(tracks.noise(), 1),
                  " times what sigma_px promises, at most ",
                  Bound(std::sqrt(options.chi2_pixel), 1),
                  " is wanted: the pixels are noisier than that, or many tracks are wrong");
  return refuse(RefusalStatus::kNotConverged, Value(options.max_passes),
                " linear solutions did not come to rest");
}

/** Where the passes have come to rest, the landmarks too. @return empty as JointSystem::covariance() */
Eigen::MatrixXd covarianceAtRest(const InitializationProblem& problem, const JointModel& model,
                                 const Nodes& nodes, const ClosedFormMotion& motion,
                                 const TrackInformation& tracks, const JointEstimate& estimate) {
  const NormalEquations visual = tracks.information(estimate.T_SS);
  return JointSystem(problem, motion, visual.curvature, tracks.s(), estimate, model)
      .covariance(estimate, nodes.keyframes, visual.score - visual.curvature);
}

Expected<void> check(const JointMapOptions& options, const TrackInformation& tracks,
                     const JointEstimate& estimate) {
  Expected<void> known =
      checkGravityDirection(estimate.sigma_gravity, options.max_sigma_gravity_deg);
  if (!known) return known;
  const double share = tracks.inlierShare(kChi2Outlier);
  if (!(share >= options.min_inlier_share))
    return refuse(RefusalStatus::kNotConverged, Value(share, 2),
                  " of the measurements agree with the solution, at least ",
                  Bound(options.min_inlier_share, 2), " is wanted");
  return {};
}

Initialization makeResult(const InitializationProblem& problem, const Nodes& nodes,
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
    if (tracks.valid()[l])
      in_V.landmarks[window.landmark_ids[l]] = estimate.R_VS * tracks.landmarks()[l];
  return alignWithGravity(problem, in_V);
}

}  // namespace

InitializationResult solveJointMap(const InitializationProblem& problem,
                                   const JointMapOptions& options) {
  Stopwatch watch;
  const Nodes nodes = chooseNodes(problem, options.frame_stride);
  const VisualWindow window =
      buildVisualWindow(problem.calibration(), nodes.frames, problem.sigmaPx());
  const StereoPoints points = stereoPoints(window, options.chi2_stereo);
  TrackInformation tracks(window, std::sqrt(options.chi2_pixel), options.least_noise);
  JointEstimate estimate;
  estimate.bias = problem.priors().mean;
  std::vector<Preintegration> preintegrations =
      preintegrate(problem, nodes, estimate.bias, options.model);
  estimate.sizes = AccelErrorSizes(static_cast<Eigen::Index>(preintegrations.size()));
  estimate.bias.gyro = gyroBiasOfPoints(points, preintegrations, problem.calibration().baseline(),
                                        problem.priors().sigma_gyro_rps);
  for (Preintegration& p : preintegrations) p = p.reintegrated(estimate.bias);
  ClosedFormMotion motion = composeMotion(preintegrations, options.model.slow_accel);
  estimate.T_VB = estimate.T_SS = medianPositions(points, rotations(motion));
  tracks.start(points, estimate.T_SS);
  if (tracks.validCount() < options.min_landmarks)
    return refuse(RefusalStatus::kTooFewTracks, Value(tracks.validCount()),
                  " landmarks of the window have a depth from both cameras, at least ",
                  Bound(options.min_landmarks), " are wanted");
  const double force = motion.nodes.back().beta.norm() / motion.nodes.back().t;
  if (const auto down = checkMeanSpecificForce(force, problem.gravityMagnitude()); !down)
    return refuse(down.error());
  const double start_ms = watch.lapMilliseconds();

  const SolverSummary summary =
      solvePasses(problem, options, &tracks, &preintegrations, &motion, &estimate);
  if (summary.termination == Termination::kSingular)
    return refuse(RefusalStatus::kIllConditioned, "the tracks of ", Value(tracks.validCount()),
                  " landmarks do not determine velocity and gravity");
  if (!summary.converged()) return notAtRest(options, tracks);
  constexpr int kMostMoves = 20;
  tracks.triangulate(estimate.T_SS, kMostMoves);
  Eigen::MatrixXd covariance;
  const bool complete = options.model.imu_noise && options.model.estimate_accel_bias;
  if (complete) {
    covariance = covarianceAtRest(problem, options.model, nodes, motion, tracks, estimate);
    if (covariance.size() == 0)
      return refuse(RefusalStatus::kIllConditioned, "the tracks of ", Value(tracks.validCount()),
                    " landmarks do not tell parallax from noise: they are too far away");
    estimate.sigma_gravity = largestSigma(covariance.block<2, 2>(6, 6));
  }
  if (const auto good = check(options, tracks, estimate); !good) return refuse(good.error());
  Initialization result = makeResult(problem, nodes, window, tracks, estimate);
  result.covariance = std::move(covariance);
  result.timings = {{"start", start_ms}, {"closed_form", watch.lapMilliseconds()}};
  if (complete || !options.covariance) return result;
  // The system takes for exact what is not, so its errors are not for itself to tell.
  JointMapOptions whole = options;
  whole.model.imu_noise = whole.model.estimate_accel_bias = true;
  JointEstimate better = estimate;
  if (solvePasses(problem, whole, &tracks, &preintegrations, &motion, &better).converged()) {
    tracks.triangulate(better.T_SS, kMostMoves);
    Initialization reference = makeResult(problem, nodes, window, tracks, better);
    reference.covariance = covarianceAtRest(problem, whole.model, nodes, motion, tracks, better);
    result.covariance = covarianceAround(reference, result);
  }
  result.timings.push_back({"covariance", watch.lapMilliseconds()});
  return result;
}

}  // namespace etalon
