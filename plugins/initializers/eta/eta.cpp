#include "etalon/core/stopwatch.h"
#include "etalon/initialization/initializer.h"
#include "etalon/initialization/steps/gravity_alignment.h"
#include "etalon/initialization/steps/inertial_only_step.h"
#include "etalon/initialization/steps/translation_step.h"

namespace etalon::plugins {

/**
 * ETA (Song et al.): the inertial-only MAP, then rotations from the gyro with its bias removed and
 * a 3-DoF bundle adjustment of the translations, then velocities and gravity anew (README.md beside
 * this file).
 */
class Eta : public Initializer {
  DEFINE_MRPT_OBJECT(Eta, etalon::plugins)

 public:
  void declareParameters(ParameterSet& parameters) override {
    map_.declare(parameters);
    translation_.declare(parameters);
  }
  bool needsVisualSolution() const override { return true; }

 protected:
  InitializationResult solve(const InitializationProblem& problem) const override {
    problem.visualSolution();  // stereo odometry does not count as this plugin's time
    Stopwatch watch;
    const Expected<InertialOnlyStep> map = solveInertialOnlyStep(problem, map_);
    if (!map) return refuse(map.error());
    const double map_ms = watch.lapMilliseconds();
    const Expected<TranslationStep> step = solveTranslationStep(
        problem, map->preintegrations, map->map.bias, map->map.g_V, translation_, map->errors);
    if (!step) return refuse(step.error());
    Initialization result = alignWithGravity(problem, step->estimate);
    result.timings = {{"inertial_only_map", map_ms},
                      {"translation_ba", step->translation_ms},
                      {"linear_alignment", step->alignment_ms}};
    return result;
  }

 private:
  InertialOnlyStepOptions map_;
  TranslationStepOptions translation_;
};

IMPLEMENTS_MRPT_OBJECT(Eta, Initializer, etalon::plugins)

}  // namespace etalon::plugins

ETALON_REGISTER_INITIALIZER(Eta, etalon::plugins, "eta", "1.0",
                            "inertial-only MAP, gyro rotations, 3-DoF BA of the translations (ETA)")
