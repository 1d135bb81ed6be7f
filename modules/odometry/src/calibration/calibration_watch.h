#pragma once

// What the prior says of the calibration, and whether to believe it. Private to the module.

#include <optional>
#include <utility>

#include "etalon/odometry/fixed_lag/online_calibration.h"
#include "etalon/odometry/odometry.h"
#include "fixed_lag/window.h"

namespace etalon::fixed_lag {

/** The deviations from the given calibration as the prior alone has them: normal equations
 * information * c = vector, everything else marginalised. */
struct CalibrationInformation {
  Eigen::Matrix<double, kCalibrationSize, kCalibrationSize> matrix;
  CalibrationVector vector;
};

/** Nothing if the prior does not determine the states. */
std::optional<CalibrationInformation> calibrationInformation(const LinearRows& prior);

/** A part of the calibration that is judged as one. */
struct CalibrationQuantity {
  const char* group;
  const char* name;
  const char* unit;
  Eigen::Index first, size;
  double unit_scale;  ///< of a column, in the unit
  /** Standard deviation of what no flight averages out, in the columns' units: errors that tracks
   * share (docs/odometry.md). */
  double systematic;
  CalibrationMode CalibrationOptions::*mode;
  const char *plus, *minus;  ///< what a deviation means; null where it has several numbers
};
constexpr size_t kQuantityCount = 9;
extern const std::array<CalibrationQuantity, kQuantityCount> kCalibrationQuantities;

/**
 * Looks once a second at what the flight says of the calibration. Nothing is believed before the
 * odometry has settled: its covariance knows roll and pitch to half a degree and the velocity to
 * 5 cm/s. The equations' standard deviation is widened by as much as the estimate has moved more
 * than it should over pieces of five seconds, which is longer than most tracks last; and by what
 * no flight averages out.
 */
class CalibrationWatch {
 public:
  /** @param used the deviation that is in use from the start; quantities with one are followed */
  explicit CalibrationWatch(const CalibrationOptions& options,
                            const CalibrationVector& used = CalibrationVector::Zero());

  /** After every frame. @return the deviation to use from now on, if it is another one */
  std::optional<CalibrationVector> update(const Window& window, const OdometryOutput& output);

  /** Sentences since the last call: what has begun to be corrected; an IMU noisier than its model. */
  std::vector<std::string> takeRemarks() { return std::exchange(remarks_, {}); }

  std::vector<CalibrationFinding> findings() const;

 private:
  struct Estimate {
    CalibrationVector mean = CalibrationVector::Zero(), variance = CalibrationVector::Zero();
  };
  void estimate(const CalibrationInformation& information);
  void followScatter(TimeNs t);
  void followInertial(const Window& window);
  bool isFree(Eigen::Index column) const;
  double widening(Eigen::Index column) const;
  double sigma(const CalibrationQuantity& quantity, Eigen::Index column) const;
  CalibrationFinding judge(const CalibrationQuantity& quantity) const;
  void choose();
  CalibrationVector toUse(const CalibrationInformation& information,
                          const CalibrationVector& now) const;

  CalibrationOptions options_;
  bool settled_ = false;
  TimeNs read_at_ = 0;
  Estimate now_, piece_begin_;
  TimeNs piece_began_ = 0;
  int pieces_ = 0;
  CalibrationVector scatter_ = CalibrationVector::Zero();  ///< sum over pieces, 1 each if honest
  double inertial_ = 0.0, inertial_readings_ = 0.0;  ///< mean square of the inertial residuals
  bool contradiction_said_ = false;
  std::array<bool, kQuantityCount> in_use_ = {};
  CalibrationVector used_ = CalibrationVector::Zero();
  std::vector<std::string> remarks_;
};

/** Standard deviations from which on an agreement is said with doubt. */
constexpr double kDoubtful = 2.0;

/** The finding as a sentence without its end, e.g. "baseline: agrees with ...". */
std::string inWords(const CalibrationFinding& finding, const CalibrationQuantity& quantity,
                    bool settled);

}  // namespace etalon::fixed_lag
