#include "etalon/benchmark/calibration/noise_calibration.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

#include "etalon/core/text.h"

namespace etalon {

namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

Vector3d chi2Of(const NoiseCheck& c) { return {c.gyro.chi2, c.accel.chi2, c.vision.chi2}; }
Vector3d dofOf(const NoiseCheck& c) { return {c.gyro.dof, c.accel.dof, c.vision.dof}; }

/** Whether the coupling can be solved. */
bool determined(const Matrix3d& coupling) {
  const Vector3d diagonal = coupling.diagonal();
  if (!(diagonal.minCoeff() > 0.0)) return false;
  const Vector3d scale = diagonal.cwiseSqrt().cwiseInverse();
  return std::abs((scale.asDiagonal() * coupling * scale.asDiagonal()).determinant()) > 1e-6;
}

/** Relative standard errors of the factors, given the covariance of the chi-squares. */
Vector3d sigmaOf(const Matrix3d& coupling, const Matrix3d& chi2_covariance) {
  const Matrix3d inverse = coupling.inverse();
  return 0.5 * (inverse * chi2_covariance * inverse.transpose()).diagonal().cwiseSqrt();
}

/** Cov(chi2_g, chi2_h) = 2 tr((I-H)_gh (I-H)_hg) for Gaussian noise of the assumed size. */
Matrix3d gaussianCovariance(const Matrix3d& coupling) { return coupling + coupling.transpose(); }

/** One factor stands for all of the accelerometer's noise (separateSlowError() tells its parts). */
InitializationProblem withoutSlowError(const InitializationProblem& problem) {
  InitializationProblem::Data data = problem.data();
  data.priors.slow_accel = SlowAcceleration();
  return InitializationProblem(std::move(data));
}

/** One window and where its last fit ended. */
class Fit {
 public:
  explicit Fit(const NoiseWindow& window) : window_(window) {}

  void refit(const NoiseFactors& factors, const Initializer& initializer,
             const WindowOptions& options) {
    ok_ = false;
    const InitializationProblem problem = withoutSlowError(window_(factors));
    std::map<LandmarkId, Eigen::Vector3d> landmarks;
    VisualInertialBaResult refined;
    if (start_) {
      refined = refine(problem, *start_, options, &landmarks);
    } else {
      InitializationAttempt attempt = attemptInitialization(problem, initializer, options);
      if (!attempt.has_vi_ba) return;
      refined = std::move(attempt.vi_ba);
      landmarks = std::move(attempt.landmarks);
    }
    if (!judge(refined, options.acceptance) || !(refined.noise.vision.dof > 0.0)) {
      start_.reset();
      return;
    }
    ok_ = true;
    check_ = refined.noise;
    keep(problem, refined, std::move(landmarks));
  }

  bool ok() const { return ok_; }
  const NoiseCheck& check() const { return check_; }
  double speed() const { return speed_mps_; }

 private:
  void keep(const InitializationProblem& problem, const VisualInertialBaResult& refined,
            std::map<LandmarkId, Eigen::Vector3d> landmarks) {
    start_.emplace();
    start_->bias = refined.bias;
    start_->landmarks = std::move(landmarks);
    double sum = 0.0;
    for (size_t k = 0; k < refined.states.size(); ++k) {
      const NavState& s = refined.states[k];
      start_->states.emplace_back(problem.keyframe(k).t, s);
      sum += s.v_WB.squaredNorm();
    }
    speed_mps_ = std::sqrt(sum / static_cast<double>(refined.states.size()));
  }

  NoiseWindow window_;
  std::optional<Initialization> start_;
  bool ok_ = false;
  NoiseCheck check_;
  double speed_mps_ = 0.0;
};

/** `value` times `factor`, limited to a factor of three and to the range that the INI takes. */
double moved(double value, double factor, double least, double most) {
  return std::clamp(value * std::clamp(factor, 1.0 / 3.0, 3.0), least, most);
}

NoiseFactors corrected(const NoiseFactors& f, const Vector3d& by) {
  return {moved(f.gyro, by[0], 0.1, 1000.0), moved(f.accel, by[1], 0.1, 1000.0),
          moved(f.sigma_px, by[2], 0.01, 100.0)};
}

/** The largest relative change of a factor that is determined. */
double largestMove(const NoiseFactors& a, const NoiseFactors& b, const Vector3d& sigma) {
  constexpr double kDetermined = 0.5;
  const Vector3d moves(b.gyro / a.gyro - 1.0, b.accel / a.accel - 1.0,
                       b.sigma_px / a.sigma_px - 1.0);
  return (sigma.array() < kDetermined).select(moves.cwiseAbs().array(), 0.0).maxCoeff();
}

/** Residuals are judged by the factors that are believed, and refuse nothing. */
WindowOptions forCalibration(WindowOptions options) {
  options.refine = options.check_noise = true;
  options.vi_ba.least_pixel_share = 1.0;
  options.acceptance.noise_margin = std::numeric_limits<double>::infinity();
  return options;
}

/** Refits all windows with `believed`; fills the iteration, and the counts and checks of `out`. */
NoiseIteration iterate(std::vector<Fit>* fits, const NoiseFactors& believed,
                       const Initializer& initializer, const NoiseCalibrationOptions& options,
                       NoiseCalibration* out) {
  const WindowOptions window = forCalibration(options.window);
  NoiseIteration iteration;
  iteration.believed = believed;
  out->checks.clear();
  out->at_rest = out->failed = 0;
  for (size_t i = 0; i < fits->size(); ++i) {
    Fit& fit = (*fits)[i];
    fit.refit(believed, initializer, window);
    if (options.progress) options.progress(i + 1, fits->size());
    if (!fit.ok()) {
      ++out->failed;
    } else if (fit.speed() < options.min_speed_mps) {
      ++out->at_rest;
    } else {
      iteration.check += fit.check();
      out->checks.push_back(fit.check());
    }
  }
  iteration.windows = out->checks.size();
  return iteration;
}

/** The larger of the chi-squares' own spread and the scatter of the windows about the sum, for the
 * number of independent windows. */
NoiseFactors relativeSigma(const NoiseCheck& sum, const std::vector<NoiseCheck>& windows,
                           double overlap) {
  Vector3d sigma = correctionOf(sum).sigma;
  if (determined(sum.coupling)) {
    Matrix3d scatter = Matrix3d::Zero();
    for (const NoiseCheck& window : windows) {
      const Vector3d d = chi2Of(window) - dofOf(window);
      scatter += d * d.transpose();
    }
    sigma = sigma.cwiseMax(sigmaOf(sum.coupling, scatter));
  }
  sigma *= std::sqrt(std::max(1.0, overlap));
  return {sigma[0], sigma[1], sigma[2]};
}

}  // namespace

NoiseCorrection correctionOf(const NoiseCheck& check) {
  NoiseCorrection correction;
  const Vector3d chi2 = chi2Of(check), dof = dofOf(check);
  Vector3d variance = Vector3d::Ones();
  for (int g = 0; g < 3; ++g)
    if (dof[g] > 0.0) {
      variance[g] = chi2[g] / dof[g];
      correction.sigma[g] = 0.5 * std::sqrt(2.0 / dof[g]);
    }
  if (determined(check.coupling)) {
    const Vector3d solved = check.coupling.inverse() * chi2;
    correction.sigma = sigmaOf(check.coupling, gaussianCovariance(check.coupling));
    // A component near or below zero cannot be told from the noise of the others.
    for (int g = 0; g < 3; ++g)
      if (solved[g] > 0.1 * variance[g]) variance[g] = solved[g];
  }
  correction.factor = variance.cwiseSqrt();
  return correction;
}

BiasPriors priorsForCalibration(BiasPriors priors) {
  const BiasPriors free;
  priors.sigma_gyro_rps = std::max(priors.sigma_gyro_rps, free.sigma_gyro_rps);
  priors.sigma_accel_mps2 = std::max(priors.sigma_accel_mps2, free.sigma_accel_mps2);
  return priors;
}

std::vector<std::string> describe(const NoiseCheck& check, double overlap) {
  const char* what[] = {"gyro: the noise density in use", "accelerometer: the noise density in use",
                        "vision: sigma_px in use"};
  NoiseCorrection correction = correctionOf(check);
  correction.sigma *= std::sqrt(std::max(1.0, overlap));
  const Vector3d chi2 = chi2Of(check), dof = dofOf(check);
  std::vector<std::string> sentences;
  for (int g = 0; g < 3; ++g) {
    std::string s = what[g];
    if (!(dof[g] > 0.0) || !(correction.sigma[g] < 0.5)) {
      sentences.push_back(s + " is not determined by these residuals");
      continue;
    }
    const double factor = correction.factor[g], sigma = correction.sigma[g];
    const double off = std::abs(factor - 1.0);
    const bool right = off < std::max(0.1, 2.0 * sigma);
    if (right) {
      s += format(
          " may be right: the residuals look like %.2f times it, +- %.0f %% at least (chi2/dof "
          "%.2f, to which the other sensors' noise adds)",
          factor, 100.0 * sigma, chi2[g] / dof[g]);
    } else {
      s += factor > 1.0 ? " is too small" : " is too large";
      s += format(" (chi2/dof %.2f): ", chi2[g] / dof[g]);
      s += format("the residuals look like %.2f times it, +- %.0f %% at least", factor,
                  100.0 * sigma);
    }
    sentences.push_back(s);
  }
  return sentences;
}

NoiseCalibration calibrateNoise(const std::vector<NoiseWindow>& windows,
                                const Initializer& initializer,
                                const NoiseCalibrationOptions& options) {
  NoiseCalibration out;
  out.windows = windows.size();
  out.factors = options.start;
  std::vector<Fit> fits(windows.begin(), windows.end());
  for (int i = 0; i < options.max_iterations && !out.converged; ++i) {
    out.iterations.push_back(iterate(&fits, out.factors, initializer, options, &out));
    const NoiseIteration& last = out.iterations.back();
    if (last.windows == 0) {
      out.message = "no window could be used: " + std::to_string(out.at_rest) + " at rest, " +
                    std::to_string(out.failed) + " not initialized";
      return out;
    }
    // A factor that hardly shows beside the others' swings about its value with full steps.
    constexpr int kFullSteps = 6;
    const NoiseCorrection step = correctionOf(last.check);
    const NoiseFactors next =
        corrected(out.factors, i < kFullSteps ? step.factor : Vector3d(step.factor.cwiseSqrt()));
    out.converged = largestMove(out.factors, next, step.sigma) < options.tolerance;
    out.factors = next;
  }
  out.relative_sigma = relativeSigma(out.iterations.back().check, out.checks, options.overlap);
  if (!out.converged)
    out.message =
        "the factors still move after " + std::to_string(options.max_iterations) + " iterations";
  return out;
}

AccelerometerError separateSlowError(const FactorAtInterval& shorter,
                                     const FactorAtInterval& longer, double density,
                                     double time_s) {
  // Variance of the integral of a slow error of variance 1, a second of the interval.
  const auto slow = [time_s](double interval_s) {
    const double x = interval_s / time_s;
    const double integral = std::sqrt(0.5 * M_PI) * x * std::erf(x / std::sqrt(2.0));
    return 2.0 * time_s * time_s * (integral + std::exp(-0.5 * x * x) - 1.0) / interval_s;
  };
  const double square = density * density;
  const double more = longer.factor * longer.factor - shorter.factor * shorter.factor;
  AccelerometerError error;
  error.white_factor = shorter.factor;
  if (!(more > 0.0)) return error;
  double variance = square * more / (slow(longer.interval_s) - slow(shorter.interval_s));
  const double white =
      shorter.factor * shorter.factor - variance * slow(shorter.interval_s) / square;
  error.white_factor = std::sqrt(std::max(white, std::min(1.0, shorter.factor * shorter.factor)));
  variance = square * (longer.factor * longer.factor - error.white_factor * error.white_factor) /
             slow(longer.interval_s);
  error.slow_mps2 = std::sqrt(variance);
  return error;
}

}  // namespace etalon
