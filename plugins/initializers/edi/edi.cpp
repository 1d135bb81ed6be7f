#include "etalon/core/angles.h"
#include "etalon/core/stopwatch.h"
#include "etalon/initialization/initializer.h"
#include "etalon/initialization/steps/combined_rows.h"
#include "rotation_filter.h"

namespace etalon::plugins {

/**
 * EDI (Wang et al., IROS 2023): attitudes and b_g by an error-state Kalman filter, then velocity,
 * gravity, b_a and, where it is free, the scale in closed form (README.md beside this file).
 */
class Edi : public Initializer {
  DEFINE_MRPT_OBJECT(Edi, etalon::plugins)

 public:
  void declareParameters(ParameterSet& parameters) override {
    options_.declare(parameters);
    options_.declareScale(parameters);
    parameters.add("filter_passes", &filter_passes_, {1, 20},
                   "Runs of the filter, at most, each around what the last one has found.");
    parameters.add("rotation_sigma_deg", &rotation_sigma_deg_, {1e-6, 10.0},
                   "Standard deviation of an attitude per axis where stereo odometry gives none, "
                   "deg.");
    parameters.add("min_landmarks", &min_landmarks_, {3, 100000},
                   "Refuse if stereo odometry has fewer landmarks in the window.");
  }
  bool needsVisualSolution() const override { return true; }

 protected:
  InitializationResult solve(const InitializationProblem& problem) const override {
    const auto visual = visualSolutionWith(problem, min_landmarks_);
    if (!visual) return refuse(visual.error());
    Stopwatch watch;
    FilteredRotations filtered =
        filterRotations(problem, **visual, filter_passes_, radians(rotation_sigma_deg_));
    const double filter_ms = watch.lapMilliseconds();
    VisualFrameEstimate& estimate = filtered.estimate;
    CombinedRowsOptions options = options_;
    options.first_velocity = true;
    const CombinedRows positions(problem, filtered.preintegrations, estimate,
                                 positionsOfPairs(estimate.T_VB, filtered.preintegrations));
    if (const auto solved = solveCombinedRows(problem, positions, options, &estimate); !solved)
      return refuse(solved.error());
    Initialization result = alignWithGravity(problem, estimate);
    result.timings = {{"rotation_filter", filter_ms}, {"closed_form", watch.lapMilliseconds()}};
    return result;
  }

 private:
  CombinedRowsOptions options_ = weighted();
  int filter_passes_ = 3;
  double rotation_sigma_deg_ = 0.05;
  int min_landmarks_ = 15;

  static CombinedRowsOptions weighted() {
    CombinedRowsOptions options;
    options.weighted = true;
    options.passes = 2;  // b_a and tilt are not linear at the first guess of gravity
    return options;
  }
};

IMPLEMENTS_MRPT_OBJECT(Edi, Initializer, etalon::plugins)

}  // namespace etalon::plugins

ETALON_REGISTER_INITIALIZER(Edi, etalon::plugins, "edi", "1.0",
                            "attitudes and gyro bias by an error-state Kalman filter, then a "
                            "weighted closed form (Wang et al. 2023)")
