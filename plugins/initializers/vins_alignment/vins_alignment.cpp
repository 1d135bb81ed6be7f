#include <optional>

#include "etalon/core/stopwatch.h"
#include "etalon/initialization/estimation_error.h"
#include "etalon/initialization/initializer.h"
#include "etalon/initialization/steps/gravity_alignment.h"
#include "etalon/initialization/steps/gyro_bias_of_rotations.h"
#include "etalon/initialization/steps/linear_alignment.h"

namespace etalon::plugins {

using Eigen::Vector3d;

/**
 * The visual-inertial alignment of VINS-Mono with the scale of a stereo camera (Qin et al., TRO
 * 2018), and what VINS-Fusion does in its place (README.md beside this file).
 */
class VinsAlignment : public Initializer {
  DEFINE_MRPT_OBJECT(VinsAlignment, etalon::plugins)

 public:
  void declareParameters(ParameterSet& parameters) override {
    parameters.add(
        "variant", &variant_,
        {{"alignment", Variant::kAlignment},
         {"esvio", Variant::kEsvio},
         {"fusion", Variant::kFusion}},
        "alignment: velocities and gravity by linear alignment (VINS-Mono). esvio: the same as "
        "published, without weights and with one solution for b_g, which is what ESVIO does with "
        "stereo poses. fusion: what VINS-Fusion does with a stereo camera, gravity from the first "
        "accelerometer readings and velocities integrated from zero.");
    parameters.add("weights", &weights_,
                   {{"none", RowWeights::kNone},
                    {"imu", RowWeights::kImu},
                    {"imu_and_vision", RowWeights::kImuAndVision}},
                   "Weights of the rows for b_g and for the alignment: none (as published), by the "
                   "covariance of the preintegration, or by that and the covariance of stereo "
                   "odometry.");
    parameters.add(
        "gyro_passes", &gyro_passes_, {1, 20},
        "Linear solutions for b_g, at most, each followed by integrating the raw IMU anew "
        "(as published: 1).");
    parameters.add(
        "gravity_iterations", &gravity_iterations_, {0, 100},
        "Iterations of gravity in the tangent plane of its sphere (VINS-Mono: 4); 0: the "
        "exact minimum on the sphere.");
    parameters.add(
        "max_gravity_deviation_mps2", &max_gravity_deviation_, {0.0, 100.0},
        "Refuse if gravity, left free, differs from its magnitude by more (VINS-Mono: 1), "
        "m/s^2.");
    parameters.add("min_landmarks", &min_landmarks_, {3, 100000},
                   "Refuse if stereo odometry has fewer landmarks in the window.");
  }
  bool needsVisualSolution() const override { return true; }

 protected:
  InitializationResult solve(const InitializationProblem& problem) const override {
    const auto found = visualSolutionWith(problem, min_landmarks_);
    if (!found) return refuse(found.error());
    const VisualSolution& visual = **found;
    Stopwatch watch;
    const auto gyro = gyroBiasOfRotations(problem, visual, weights(), gyroPasses());
    if (!gyro) return refuse(gyro.error());
    const std::vector<Preintegration>& preintegrations = gyro->preintegrations;
    VisualFrameEstimate estimate = gyro->estimate(problem, visual);
    const double gyro_ms = watch.lapMilliseconds();

    std::optional<VisualFrameEstimate> fusion;
    if (variant_ == Variant::kFusion) fusion = asFusion(problem, preintegrations, estimate);
    const auto aligned = align(problem, visual, preintegrations, &estimate);
    if (!aligned && !fusion) return refuse(aligned.error());
    Initialization result = alignWithGravity(problem, fusion ? *fusion : estimate);
    if (aligned && fusion)
      result.covariance = covarianceAround(alignWithGravity(problem, estimate), result);
    result.timings = {{"gyro_bias", gyro_ms}, {"linear_alignment", watch.lapMilliseconds()}};
    return result;
  }

 private:
  enum class Variant { kAlignment, kEsvio, kFusion };

  RowWeights weights() const { return variant_ == Variant::kEsvio ? RowWeights::kNone : weights_; }
  int gyroPasses() const { return variant_ == Variant::kEsvio ? 1 : gyro_passes_; }

  /** Fills velocities and gravity. */
  Expected<void> align(const InitializationProblem& problem, const VisualSolution& visual,
                       const std::vector<Preintegration>& preintegrations,
                       VisualFrameEstimate* estimate) const {
    LinearAlignmentOptions options;
    options.gravity_mps2 = problem.gravityMagnitude();
    options.weighted = weights() != RowWeights::kNone;
    if (weights() == RowWeights::kImuAndVision) options.pose_covariance = visual.covariance;
    options.tangent_iterations = gravity_iterations_;
    const LinearAlignmentResult alignment =
        alignLinearly(visual.T_VB, preintegrations, estimate->bias, options);
    if (!alignment.summary.usable())
      return refuse(RefusalStatus::kIllConditioned, Value(problem.keyframeCount()),
                    " keyframes do not determine velocities and gravity");
    if (const auto plausible = checkFreeGravity(alignment.free_gravity_mps2,
                                                problem.gravityMagnitude(), max_gravity_deviation_);
        !plausible)
      return refuse(plausible.error());
    estimate->v_VB = alignment.v_VB;
    estimate->g_V = alignment.g_V;
    if (estimate->errors &&
        !alignErrors(visual.T_VB, preintegrations, estimate->bias, options, alignment.g_V,
                     estimate->errors->sources.poses(), &*estimate->errors))
      estimate->errors.reset();
    return {};
  }

  /** Takes gravity from the mean specific force between the first two frames and integrates the
   * velocities from zero. */
  static VisualFrameEstimate asFusion(const InitializationProblem& problem,
                                      const std::vector<Preintegration>& preintegrations,
                                      VisualFrameEstimate estimate) {
    estimate.errors.reset();
    const TimeNs start = problem.frames().front().t;
    Vector3d sum = Vector3d::Zero();
    for (const ImuSample& s : problem.imu().between(start, problem.frames()[1].t)) sum += s.accel;
    estimate.g_V = -problem.gravityMagnitude() * (estimate.T_VB.front().R * sum).normalized();
    estimate.v_VB.assign(1, Vector3d::Zero());
    for (size_t k = 0; k < preintegrations.size(); ++k)
      estimate.v_VB.emplace_back(estimate.v_VB[k] + estimate.g_V * preintegrations[k].dt() +
                                 estimate.T_VB[k].R * preintegrations[k].deltas().dv);
    return estimate;
  }

  Variant variant_ = Variant::kAlignment;
  RowWeights weights_ = RowWeights::kImu;
  int gyro_passes_ = 3;
  int gravity_iterations_ = 4;
  double max_gravity_deviation_ = 1.0;
  int min_landmarks_ = 15;
};

IMPLEMENTS_MRPT_OBJECT(VinsAlignment, Initializer, etalon::plugins)

}  // namespace etalon::plugins

ETALON_REGISTER_INITIALIZER(VinsAlignment, etalon::plugins, "vins_alignment", "1.0",
                            "gyro bias from rotations, linear alignment of velocities and gravity "
                            "(Qin et al. 2018)")
