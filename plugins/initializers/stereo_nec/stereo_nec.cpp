#include <Eigen/LU>

#include "etalon/core/stopwatch.h"
#include "etalon/initialization/initializer.h"
#include "etalon/initialization/steps/gravity_alignment.h"
#include "etalon/initialization/steps/inertial_only_step.h"
#include "etalon/initialization/steps/normal_epipolar_step.h"
#include "etalon/initialization/steps/translation_step.h"

namespace etalon::plugins {

/**
 * Stereo-NEC (Wang et al., ICRA 2024): the gyro bias from normal epipolar constraints, with it the
 * inertial-only MAP, then rotations from the gyro and a 3-DoF bundle adjustment of the translations
 * (README.md beside this file).
 */
class StereoNec : public Initializer {
  DEFINE_MRPT_OBJECT(StereoNec, etalon::plugins)

 public:
  void declareParameters(ParameterSet& parameters) override {
    parameters.add("nec_seed", &seed_,
                   {{"visual_odometry", Seed::kVisualOdometry}, {"prior", Seed::kPrior}},
                   "Where the search for b_g starts: at the bias that stereo odometry's rotations "
                   "say, or at the prior's mean.");
    parameters.add("nec_in_map", &in_map_,
                   {{"prior", InMap::kPrior}, {"seed", InMap::kSeed}, {"hold", InMap::kHold}},
                   "What the MAP does with the b_g of the normal epipolar constraints: takes it as "
                   "a measurement with its covariance, starts there (as published), or keeps it.");
    nec_.declare(parameters);
    map_.declare(parameters);
    translation_.declare(parameters);
  }
  bool needsVisualSolution() const override { return true; }

 protected:
  InitializationResult solve(const InitializationProblem& problem) const override {
    const Expected<VisualSolution>& visual =
        problem.visualSolution();  // not counted as this plugin's time
    if (!visual) return refuse(visual.error());
    Stopwatch watch;
    const std::vector<Preintegration> preintegrations = problem.preintegrate(problem.priors().mean);
    Eigen::Vector3d seed = problem.priors().mean.gyro;
    if (seed_ == Seed::kVisualOdometry) {
      std::vector<Eigen::Matrix3d> rotations;
      for (const SE3& T_VB : visual->T_VB) rotations.push_back(T_VB.R);
      seed = gyroBiasFromRotations(rotations, preintegrations);
    }
    const Expected<NormalEpipolarBias> nec =
        solveNormalEpipolarStep(problem, preintegrations, seed, nec_);
    if (!nec) return refuse(nec.error());
    const double nec_ms = watch.lapMilliseconds();

    const Expected<InertialOnlyStep> map =
        solveInertialOnlyStep(problem, map_, measurement(*nec), nec->errors);
    if (!map) return refuse(map.error());
    const double map_ms = watch.lapMilliseconds();

    const Expected<TranslationStep> step = solveTranslationStep(
        problem, map->preintegrations, map->map.bias, map->map.g_V, translation_, map->errors);
    if (!step) return refuse(step.error());
    Initialization result = alignWithGravity(problem, step->estimate);
    result.timings = {{"normal_epipolar", nec_ms},
                      {"inertial_only_map", map_ms},
                      {"translation_ba", step->translation_ms},
                      {"linear_alignment", step->alignment_ms}};
    return result;
  }

 private:
  enum class Seed { kVisualOdometry, kPrior };
  enum class InMap { kPrior, kSeed, kHold };

  GyroBiasMeasurement measurement(const NormalEpipolarBias& bias) const {
    GyroBiasMeasurement measured;
    measured.gyro = bias.gyro;
    // A sigma of 1e-7 rad/s leaves the MAP no freedom.
    if (in_map_ == InMap::kHold) measured.information = 1e14 * Eigen::Matrix3d::Identity();
    if (in_map_ == InMap::kPrior) measured.information = bias.covariance.inverse();
    return measured;
  }

  Seed seed_ = Seed::kVisualOdometry;
  InMap in_map_ = InMap::kPrior;
  NormalEpipolarStepOptions nec_;
  InertialOnlyStepOptions map_;
  TranslationStepOptions translation_;
};

IMPLEMENTS_MRPT_OBJECT(StereoNec, Initializer, etalon::plugins)

}  // namespace etalon::plugins

ETALON_REGISTER_INITIALIZER(
    StereoNec, etalon::plugins, "stereo_nec", "1.0",
    "normal epipolar gyro bias, inertial-only MAP, gyro rotations, 3-DoF BA (Stereo-NEC)")
