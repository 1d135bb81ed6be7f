#include "etalon/core/stopwatch.h"
#include "etalon/initialization/initializer.h"
#include "etalon/initialization/steps/gyro_bias_of_rotations.h"
#include "triple_alignment.h"

namespace etalon::plugins {

/**
 * The initialization of visual-inertial ORB-SLAM (Mur-Artal and Tardos, RA-L 2017, section IV) on
 * the poses of stereo odometry (README.md beside this file).
 */
class ViOrb : public Initializer {
  DEFINE_MRPT_OBJECT(ViOrb, etalon::plugins)

 public:
  void declareParameters(ParameterSet& parameters) override {
    parameters.add("weighted", &options_.weighted,
                   "false: the equations of three keyframes as they are, b_a without a prior (as "
                   "published). true: weighted by the covariance of IMU and stereo odometry, with "
                   "the prior on b_a.");
    parameters.add("free_scale", &options_.free_scale,
                   "false: the scale is the stereo camera's. true: it is an unknown, as with one "
                   "camera.");
    parameters.add("gyro_passes", &gyro_passes_, {1, 20},
                   "Linear solutions for b_g, at most, each followed by integrating the raw IMU "
                   "anew.");
    parameters.add("gravity_passes", &options_.passes, {1, 100},
                   "Solutions for gravity's direction and b_a, each linearised at the last one (as "
                   "published: 1).");
    parameters.add("max_condition", &options_.max_condition, {1.0, 1e12},
                   "Refuse if the condition number of these equations, columns of unit length, is "
                   "larger.");
    parameters.add("max_gravity_deviation_mps2", &options_.max_gravity_deviation_mps2, {0.0, 100.0},
                   "Refuse if gravity, its magnitude free and b_a the mean of its prior, differs "
                   "from its magnitude by more, m/s^2.");
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
    const auto gyro = gyroBiasOfRotations(
        problem, visual, options_.weighted ? RowWeights::kImuAndVision : RowWeights::kNone,
        gyro_passes_);
    if (!gyro)
      return refuse(RefusalStatus::kIllConditioned, "the rotations of ",
                    Value(problem.keyframeCount()), " keyframes do not determine the gyro bias");
    const double gyro_ms = watch.lapMilliseconds();

    VisualFrameEstimate estimate;
    estimate.T_VB = visual.T_VB;
    estimate.landmarks = visual.landmarks;
    estimate.bias = gyro->bias;
    estimate.errors = gyro->errors(problem, visual);
    if (const auto aligned = alignTriples(problem, gyro->preintegrations, options_, &estimate);
        !aligned)
      return refuse(aligned.error());
    Initialization result = alignWithGravity(problem, estimate);
    result.timings = {{"gyro_bias", gyro_ms}, {"triples", watch.lapMilliseconds()}};
    return result;
  }

 private:
  TripleAlignmentOptions options_;
  int gyro_passes_ = 3;
  int min_landmarks_ = 15;
};

IMPLEMENTS_MRPT_OBJECT(ViOrb, Initializer, etalon::plugins)

}  // namespace etalon::plugins

ETALON_REGISTER_INITIALIZER(ViOrb, etalon::plugins, "vi_orb", "1.0",
                            "gyro bias from rotations, gravity and b_a from three keyframes at a "
                            "time (Mur-Artal and Tardos 2017)")
