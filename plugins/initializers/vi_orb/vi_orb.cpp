#include "etalon/core/stopwatch.h"
#include "etalon/initialization/initializer.h"
#include "etalon/initialization/steps/combined_rows.h"
#include "etalon/initialization/steps/gyro_bias_of_rotations.h"

namespace etalon::plugins {

/**
 * The initialization of visual-inertial ORB-SLAM (Mur-Artal and Tardos, RA-L 2017, section IV) on
 * the poses of stereo odometry (README.md beside this file).
 */
class ViOrb : public Initializer {
  DEFINE_MRPT_OBJECT(ViOrb, etalon::plugins)

 public:
  void declareParameters(ParameterSet& parameters) override {
    options_.declare(parameters);
    options_.declareScale(parameters);
    parameters.add("gyro_passes", &gyro_passes_, {1, 20},
                   "Linear solutions for b_g, at most, each followed by integrating the raw IMU "
                   "anew.");
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
    if (!gyro) return refuse(gyro.error());
    const double gyro_ms = watch.lapMilliseconds();

    VisualFrameEstimate estimate = gyro->estimate(problem, visual);
    const CombinedRows triples(problem, gyro->preintegrations, estimate,
                               triplesOfPairs(estimate.T_VB, gyro->preintegrations));
    if (const auto solved = solveCombinedRows(problem, triples, options_, &estimate); !solved)
      return refuse(solved.error());
    Initialization result = alignWithGravity(problem, estimate);
    result.timings = {{"gyro_bias", gyro_ms}, {"triples", watch.lapMilliseconds()}};
    return result;
  }

 private:
  CombinedRowsOptions options_;
  int gyro_passes_ = 3;
  int min_landmarks_ = 15;
};

IMPLEMENTS_MRPT_OBJECT(ViOrb, Initializer, etalon::plugins)

}  // namespace etalon::plugins

ETALON_REGISTER_INITIALIZER(ViOrb, etalon::plugins, "vi_orb", "1.0",
                            "gyro bias from rotations, gravity and b_a from three keyframes at a "
                            "time (Mur-Artal and Tardos 2017)")
