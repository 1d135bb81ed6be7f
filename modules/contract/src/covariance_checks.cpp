#include <algorithm>
#include <cmath>
#include <numeric>
#include <optional>
#include <random>

#include "check_tools.h"
#include "etalon/core/statistics.h"
#include "etalon/core/symmetric.h"
#include "etalon/initialization/estimation_error.h"

namespace etalon::contract {

namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

struct Block {
  const char* name;
  int start, size;
};
constexpr Block kBlocks[] = {{"b_g", 0, 3}, {"b_a", 3, 3}, {"gravity", 6, 2}, {"velocity", 8, 3}};
constexpr int kSize = 11;
constexpr char kGivesNone[] = "gives none; its README is to say why";

/** Smallest eigenvalue of the matrix scaled to unit diagonal: units do not matter then; not
 * positive if a variance is not. */
double smallestCorrelationEigenvalue(const MatrixXd& P) {
  if (!(P.diagonal().minCoeff() > 0.0)) return std::min(0.0, P.diagonal().minCoeff());
  const VectorXd scale = P.diagonal().cwiseSqrt().cwiseInverse();
  const MatrixXd correlation = scale.asDiagonal() * P * scale.asDiagonal();
  return symmetricEigenvalues(correlation)[0];
}

/** Largest difference of elements that should be the same, as a correlation. */
double correlationAsymmetry(const MatrixXd& P) {
  double largest = 0.0;
  for (Eigen::Index i = 0; i < P.rows(); ++i) {
    for (Eigen::Index j = 0; j < i; ++j) {
      const double difference = std::abs(P(i, j) - P(j, i));
      const double scale = std::sqrt(std::abs(P(i, i) * P(j, j)));
      if (difference > 0.0) largest = std::max(largest, difference / scale);
    }
  }
  return largest;
}

// Below this a correlation matrix cannot be told from a singular one: 11 times rounding is 2e-15.
constexpr double kSingular = 1e-13;

ContractCheck isPositiveDefinite(const Initializer& initializer, const ContractOptions&) {
  int given = 0;
  double smallest = 1.0;
  for (const Motion motion : testing::kAllMotions) {
    const Answer answer = ask(initializer, Trial(noisyOptions(motion, 3)).problem());
    if (!answer.broken.empty()) return failed(answer.broken);
    if (!answer.result || answer.result->covariance.size() == 0) continue;
    const MatrixXd& P = answer.result->covariance;
    ++given;
    const double asymmetry = correlationAsymmetry(P);
    if (!(asymmetry < 1e-9))
      return failed(
          format("%s: not symmetric, by a correlation of %.2g", toString(motion), asymmetry),
          asymmetry);
    const double eigenvalue = smallestCorrelationEigenvalue(P);
    if (eigenvalue < kSingular)
      return failed(format("%s: not positive definite, smallest eigenvalue of the correlations "
                           "%.2g (at least %.0g is wanted)",
                           toString(motion), eigenvalue, kSingular),
                    eigenvalue);
    smallest = std::min(smallest, eigenvalue);
  }
  if (given == 0) return notApplicable(kGivesNone);
  return passed(format("%d motions: symmetric, smallest eigenvalue of the correlations %.2g", given,
                       smallest),
                smallest);
}

/** A window whose noise and biases are drawn from what the problem believes. */
Trial drawnTrial(Motion motion, unsigned seed) {
  SyntheticWindowOptions options = noisyOptions(motion, seed);
  options.landmarks = 100;  // as good for statistics, and half the time
  std::mt19937 rng(seed + 1'000'000);
  std::normal_distribution<double> normal;
  for (int a = 0; a < 3; ++a) {
    options.bias.gyro[a] = options.priors.sigma_gyro_rps * normal(rng);
    options.bias.accel[a] = options.priors.sigma_accel_mps2 * normal(rng);
  }
  Trial trial(options);
  // The biases of a synthetic window do not walk, so the problem may not believe that they do; not
  // zero, for those who divide by it.
  ImuNoiseDensities& noise = trial.window.calibration.imu.noise;
  noise.gyro_random_walk *= 1e-3;
  noise.accel_random_walk *= 1e-3;
  return trial;
}

/** Errors with the covariances that were claimed for them. */
class Nees {
 public:
  void add(Motion motion, const VectorXd& error, const MatrixXd& P) {
    motions_.push_back(motion);
    errors_.push_back(error);
    covariances_.push_back(P);
  }
  /** The windows of one motion. */
  Nees of(Motion motion) const {
    Nees part;
    for (size_t i = 0; i < motions_.size(); ++i)
      if (motions_[i] == motion) part.add(motion, errors_[i], covariances_[i]);
    return part;
  }
  /** Rows of [rotation, position] of the poses, where every window has them in equal number. */
  std::vector<int> poseIndices(int part) const {
    std::vector<int> indices;
    for (const MatrixXd& P : covariances_)
      if (P.rows() != covariances_.front().rows()) return {};
    for (int i = kSize; i + 6 <= covariances_.front().rows(); i += 6)
      for (int axis = 0; axis < 3; ++axis) indices.push_back(i + 3 * part + axis);
    return indices;
  }
  int windows() const { return errors_.size(); }

  /** Average over its expectation, 1 is consistent; nothing if a covariance is singular. */
  std::optional<double> ratio(const std::vector<int>& indices) const {
    double sum = 0.0;
    for (size_t i = 0; i < errors_.size(); ++i) {
      const MatrixXd P = covariances_[i](indices, indices);
      if (smallestCorrelationEigenvalue(P) < kSingular) return std::nullopt;
      const VectorXd e = errors_[i](indices);
      sum += squaredMahalanobis(e, P);
    }
    return sum / static_cast<double>(indices.size() * errors_.size());
  }

  /** Whether the truth is hit in every window but for rounding. A platform at rest has no velocity,
   * whatever a method must allow for: there is no scatter to compare with a covariance. */
  bool neverErrs(const std::vector<int>& indices) const {
    return std::all_of(errors_.begin(), errors_.end(), [&](const VectorXd& e) {
      return VectorXd(e(indices)).cwiseAbs().maxCoeff() < 1e-9;
    });
  }

 private:
  std::vector<Motion> motions_;
  std::vector<VectorXd> errors_;
  std::vector<MatrixXd> covariances_;
};

/** A ratio and the bounds that this number of windows sets it. */
struct Judgement {
  double ratio = 1.0, low = 0.0, high = 0.0;
  const char* verdict() const {
    return ratio > high ? "too optimistic" : ratio < low ? "too pessimistic" : "";
  }
};

/** The bounds are those of a true ratio between 1/allowed and allowed, each widened by the 99 %
 * band of the chi-square distribution. */
Judgement judge(double ratio, double dof, double allowed) {
  constexpr double kTail = 0.005;  // on either side of 99 %
  return {ratio, chiSquareQuantile(dof, 1.0 - kTail) / dof / allowed,
          chiSquareQuantile(dof, kTail) / dof * allowed};
}

/** Gentle and aggressive motion, or one of them, if the method gives a covariance there; else the
 * first motion in which it does. */
std::vector<Motion> motionsWithCovariance(const Initializer& initializer) {
  std::vector<Motion> motions;
  for (const Motion motion : testing::kAllMotions) {
    if (!motions.empty() && motion != Motion::kGentle && motion != Motion::kAggressive) break;
    const InitializationResult result = initializer.initialize(drawnTrial(motion, 1).problem());
    if (result && result->covariance.size() > 0) motions.push_back(motion);
  }
  return motions;
}

/** All errors jointly, then block by block: a block that is too large must not make up for another
 * that is too small. */
ContractCheck judgeNees(const Nees& nees, const char* motion, double allowed) {
  std::vector<int> all;
  std::string blocks, complaints;
  const auto add = [&](const char* name, const std::vector<int>& indices) {
    const std::optional<double> ratio = nees.ratio(indices);
    if (!ratio) return std::string("singular");
    const Judgement judgement =
        judge(*ratio, static_cast<double>(indices.size()) * nees.windows(), allowed);
    if (*judgement.verdict() != '\0')
      complaints += format("; %s: %s, %.2f is not in %.2f to %.2f", name, judgement.verdict(),
                           *ratio, judgement.low, judgement.high);
    return format("%.2f", *ratio);
  };
  for (const Block& block : kBlocks) {
    std::vector<int> indices(block.size);
    std::iota(indices.begin(), indices.end(), block.start);
    blocks += std::string(", ") + block.name + " ";
    if (nees.neverErrs(indices)) {
      blocks += "never errs, left out";
      continue;
    }
    all.insert(all.end(), indices.begin(), indices.end());
    blocks += add(block.name, indices);
  }
  // The poses are judged apart: they are many, and would hide the rest.
  for (const int part : {0, 1}) {
    const std::vector<int> indices = nees.poseIndices(part);
    const char* name = part == 0 ? "rotations" : "positions";
    if (!indices.empty() && !nees.neverErrs(indices))
      blocks += std::string(", ") + name + " " + add(name, indices);
  }
  const std::string whole = all.empty() ? "never errs" : add("all", all);
  const double value = nees.ratio(all).value_or(0.0);
  const std::string text = format("%d windows, %s: average NEES over its expectation %s",
                                  nees.windows(), motion, whole.c_str()) +
                           blocks;
  if (!complaints.empty()) return failed(text + complaints, value);
  const Judgement bounds = judge(1.0, static_cast<double>(all.size()) * nees.windows(), allowed);
  return passed(text + format("; %.2f to %.2f is let pass", bounds.low, bounds.high), value);
}

/** What the drawn windows say, each with its motion; those without a covariance are left out. */
Nees drawNees(const Initializer& initializer, const std::vector<Motion>& motions, int windows) {
  Nees nees;
  for (int i = 0; i < windows; ++i) {
    const Motion motion = motions[i % motions.size()];
    const Trial trial = drawnTrial(motion, static_cast<unsigned>(i + 1));
    const InitializationResult result = initializer.initialize(trial.problem());
    if (!result || result->covariance.size() == 0) continue;
    VectorXd error(kSize + 6 * (result->states.size() - 1));
    error << testing::estimationError(*result, trial.window),
        relativePoseErrors(result->states, trial.window.truth);
    nees.add(motion, error, result->covariance);
  }
  return nees;
}

std::vector<std::string> describeByMotion(const Nees& nees, const std::vector<Motion>& motions,
                                          double allowed) {
  std::vector<std::string> lines;
  if (motions.size() < 2) return lines;
  for (const Motion motion : motions) {
    const Nees part = nees.of(motion);
    lines.push_back(part.windows() == 0 ? format("0 windows, %s: no covariance", toString(motion))
                                        : judgeNees(part, toString(motion), allowed).detail);
  }
  return lines;
}

ContractCheck isConsistent(const Initializer& initializer, const ContractOptions& options) {
  const std::vector<Motion> motions = options.monte_carlo_motions.empty()
                                          ? motionsWithCovariance(initializer)
                                          : options.monte_carlo_motions;
  if (motions.empty()) return notApplicable(kGivesNone);
  std::string names;
  for (const Motion motion : motions)
    names += (names.empty() ? "" : " and ") + std::string(toString(motion));
  const Nees nees = drawNees(initializer, motions, options.monte_carlo_windows);
  // A method that answers only where it is easy would look more consistent than it is.
  ContractCheck check =
      2 * nees.windows() < options.monte_carlo_windows
          ? failed(format("%s: gives a covariance for only %d of %d windows", names.c_str(),
                          nees.windows(), options.monte_carlo_windows),
                   nees.windows())
          : judgeNees(nees, names.c_str(), options.allowed_nees_factor);
  check.by_motion = describeByMotion(nees, motions, options.allowed_nees_factor);
  return check;
}

}  // namespace

std::vector<CheckEntry> covarianceChecks() {
  return {{{"covariance.positive_definite",
            "A covariance, where there is one, is symmetric and positive definite."},
           isPositiveDefinite},
          {{"covariance.consistent",
            "Monte Carlo: errors are as large as the covariance says (average NEES)."},
           isConsistent}};
}

}  // namespace etalon::contract
