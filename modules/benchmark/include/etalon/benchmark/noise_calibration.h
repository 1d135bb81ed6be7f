#pragma once

#include <Eigen/Core>
#include <functional>
#include <limits>
#include <string>
#include <vector>

#include "etalon/optimization/bundle/noise_check.h"
#include "etalon/pipeline/window_initialization.h"

namespace etalon {

/** What is believed of the noise: factors on the data sheet's white-noise densities, and pixels. */
struct NoiseFactors {
  double gyro = 1.0, accel = 1.0;
  double sigma_px = 0.29;
};

/**
 * How many times larger than believed the standard deviations are, as the residuals tell: Helmert's
 * variance components, coupling * factor^2 = chi2. Order gyro, accel, vision. Where that has no
 * positive solution, or no coupling is known, sqrt(chi2 / dof), which goes in the right direction
 * but too short.
 */
struct NoiseCorrection {
  Eigen::Vector3d factor = Eigen::Vector3d::Ones();
  /** Relative standard errors of the factors, from the chi-squares' own spread: at least this.
   * Infinite where the residuals say nothing. */
  Eigen::Vector3d sigma = Eigen::Vector3d::Constant(std::numeric_limits<double>::infinity());
};

NoiseCorrection correctionOf(const NoiseCheck& check);

/**
 * The check in words, a sentence a sensor: whether its noise is believed right, too small or too
 * large (by more than two standard errors and 10 %), with chi2/dof and the factor that puts it
 * right; or that the residuals do not determine it.
 * @param overlap NoiseCalibrationOptions::overlap of the windows behind the check
 */
std::vector<std::string> describe(const NoiseCheck& check, double overlap = 1.0);

/** Priors under which the noise is estimated: none narrower than the built-in ones. A prior that
 * pins a bias where it is not makes the sensor look noisy. */
BiasPriors priorsForCalibration(BiasPriors priors);

/** A window as a problem, given what is believed of the noise. The same window every time. */
using NoiseWindow = std::function<InitializationProblem(const NoiseFactors&)>;

struct NoiseCalibrationOptions {
  NoiseFactors start;
  WindowOptions window;
  double tolerance = 0.01;  ///< done when no factor moves farther, relative
  int max_iterations = 25;
  /** The number of windows that hold one instant: the length of a window over the step to the next
   * one, at least 1. Windows that share their data are not independent: the standard errors grow
   * with its square root. */
  double overlap = 1.0;
  /** Windows in which the body is slower (RMS over the keyframes, after VI-BA) are at rest and left
   * out, m/s: without vibration the noise is another. 0 keeps all. */
  double min_speed_mps = 0.1;
  std::function<void(size_t, size_t)> progress;  ///< windows done and of all, an iteration
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
  /** Relative standard errors, in the members' order: the larger of what chi-squares allow and the
   * scatter from window to window, as of independent windows (NoiseCalibrationOptions::overlap). */
  NoiseFactors relative_sigma{0.0, 0.0, 0.0};
  std::vector<NoiseIteration> iterations;
  int windows = 0, at_rest = 0, failed = 0;  ///< offered; and left out in the last iteration
  /** What is left in the last iteration, a window. */
  std::vector<NoiseCheck> checks;
};

/**
 * Estimates the noise from residuals alone: variance components, iterated. Every window is
 * initialised once and then refitted by VI-BA from where it was, with the factors of the last
 * iteration; the chi-squares of all windows together give the next factors. Ground truth is not
 * used. A window takes part if VI-BA's result passes `options.window.acceptance` but for the tests
 * of the residuals, which would choose the windows by what is to be measured.
 *
 * The windows should be made with priorsForCalibration(). White noise only: the random walks stay
 * the data sheet's. Deterministic.
 */
NoiseCalibration calibrateNoise(const std::vector<NoiseWindow>& windows,
                                const Initializer& initializer,
                                const NoiseCalibrationOptions& options);

/** The section [imu_noise] that puts the factors in use, and sigma_px as a comment: it is not to be
 * trusted where a track's pixels err alike. `comment` lines first. */
std::string toIni(const NoiseFactors& factors, const std::vector<std::string>& comment);

}  // namespace etalon
