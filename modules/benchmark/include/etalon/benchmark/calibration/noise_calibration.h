#pragma once

#include <Eigen/Core>
#include <functional>
#include <limits>
#include <string>
#include <vector>

#include "etalon/core/tracked_frame.h"
#include "etalon/optimization/bundle/noise_check.h"
#include "etalon/pipeline/window_initialization.h"

namespace etalon {

/** The assumed noise: factors on the data sheet's white-noise densities, and the pixels' sigma. */
struct NoiseFactors {
  double gyro = 1.0, accel = 1.0;
  double sigma_px = kTrackSigmaPx;
};

/**
 * How many times larger than assumed the standard deviations are, estimated from the residuals by
 * Helmert's variance components, coupling * factor^2 = chi2. The order is gyro, accel, vision.
 * Where the equation has no positive solution, or no coupling is known, the factor is
 * sqrt(chi2 / dof), a step in the right direction but too short.
 */
struct NoiseCorrection {
  Eigen::Vector3d factor = Eigen::Vector3d::Ones();
  /** Relative standard errors of the factors from the chi-squares' own spread alone, so a lower
   * bound. Infinite where the residuals do not determine a factor. */
  Eigen::Vector3d sigma = Eigen::Vector3d::Constant(std::numeric_limits<double>::infinity());
};

NoiseCorrection correctionOf(const NoiseCheck& check);

/**
 * The check in words, a sentence for each sensor: whether its noise is assumed right, too small or
 * too large (by more than two standard errors and 10 %), with chi2/dof and the factor that corrects
 * it; or that the residuals do not determine it.
 * @param overlap NoiseCalibrationOptions::overlap of the windows behind the check
 */
std::vector<std::string> describe(const NoiseCheck& check, double overlap = 1.0);

/** Priors under which the noise is estimated: none narrower than the built-in ones. A prior that
 * pins a bias at a wrong value makes the sensor look noisy. */
BiasPriors priorsForCalibration(BiasPriors priors);

/** Makes a window's problem for the assumed noise. It is the same window every time. */
using NoiseWindow = std::function<InitializationProblem(const NoiseFactors&)>;

struct NoiseCalibrationOptions {
  NoiseFactors start;
  WindowOptions window;
  double tolerance = 0.01;  ///< converged when no factor that is determined to
                            ///< a half changes by more, relative
  int max_iterations = 25;
  /** The number of windows that hold one instant: the length of a window over the step to the next
   * one, at least 1. Windows that share their data are not independent: the standard errors grow
   * with its square root. */
  double overlap = 1.0;
  /** Windows in which the body is slower (RMS over the keyframes, after VI-BA) are at rest and left
   * out, m/s, because the noise differs without vibration. 0 keeps all. */
  double min_speed_mps = 0.1;
  std::function<void(size_t, size_t)> progress;  ///< windows done and all windows, per iteration
};

/** One refit of all windows. */
struct NoiseIteration {
  NoiseFactors believed;
  NoiseCheck check;
  int windows = 0;  ///< in the check
};

struct NoiseCalibration {
  bool converged = false;
  std::string message;  ///< why not; empty otherwise
  NoiseFactors factors;
  /** Relative standard errors, in the members' order: the larger of the chi-squares' own spread and
   * the scatter from window to window, corrected for NoiseCalibrationOptions::overlap. */
  NoiseFactors relative_sigma{0.0, 0.0, 0.0};
  std::vector<NoiseIteration> iterations;
  int windows = 0, at_rest = 0, failed = 0;  ///< offered; and left out in the last iteration
  /** The checks of the last iteration, one for each window. */
  std::vector<NoiseCheck> checks;
};

/**
 * Estimates the noise from residuals alone: variance components, iterated. Every window is
 * initialized once and then refitted by VI-BA from its last result, with the factors of the last
 * iteration; the chi-squares of all windows together give the next factors. Ground truth is not
 * used. A window takes part if VI-BA's result passes `options.window.acceptance`, without the tests
 * of the residuals, which would select the windows by the quantity to be measured.
 *
 * The windows should be made with priorsForCalibration(). Only white noise is estimated: the random
 * walks stay the data sheet's. Deterministic.
 */
NoiseCalibration calibrateNoise(const std::vector<NoiseWindow>& windows,
                                const Initializer& initializer,
                                const NoiseCalibrationOptions& options);

/** An accelerometer's factor as found between keyframes that are so far apart. */
struct FactorAtInterval {
  double factor = 1.0, interval_s = 0.25;
};

/** An accelerometer's error that is partly white and partly slow (SlowAcceleration). */
struct AccelerometerError {
  double white_factor = 1.0;  ///< on the data sheet's density
  double slow_mps2 = 0.0;     ///< standard deviation of the slow part, m/s^2
};

/**
 * Two intervals tell what is white from what is slow: over an interval d white noise of density s
 * changes the velocity by a variance s^2 d, and a slow error of variance q^2 and time T, x = d / T, by
 * 2 q^2 T^2 (sqrt(pi / 2) x erf(x / sqrt(2)) + exp(-x^2 / 2) - 1), the double integral of its
 * correlation. Both factors are such variances over d. The white part is no less than the data sheet's, or than `shorter` where
 * that is less still; the slow one then makes the longer interval right.
 * @param density the data sheet's, m/s^2/sqrt(Hz)
 * @param time_s T, believed
 */
AccelerometerError separateSlowError(const FactorAtInterval& shorter,
                                     const FactorAtInterval& longer, double density, double time_s);

}  // namespace etalon
