#include "etalon/imu/bias_prediction.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "etalon/core/statistics.h"

namespace etalon {
namespace {

using Eigen::Vector3d;

constexpr double kFreedom = 4.0;  // of the t distribution

/** The flights given one scale between them. */
struct GivenScale {
  Vector3d mean = Vector3d::Zero();
  double mean_variance = 0.0;  ///< of the mean, an axis
  double log_posterior = 0.0;  ///< of the scale's logarithm, but for a constant
};

/** mu by iteratively reweighted least squares (EM), and the scale's posterior there. */
GivenScale givenScale(const std::vector<SensorBias>& flights, double scale, double wide,
                      Vector3d mean) {
  constexpr int kIterations = 100;
  constexpr double kStandsStill = 1e-9;  // of the scale
  GivenScale result;
  Vector3d information;
  for (int i = 0; i < kIterations; ++i) {
    information.setZero();
    Vector3d sum = Vector3d::Zero();
    result.log_posterior = 0.0;
    for (const SensorBias& flight : flights) {
      const Vector3d variance = flight.sigma.cwiseAbs2().array() + scale * scale;
      const double distance = (flight.mean - mean).cwiseAbs2().cwiseQuotient(variance).sum();
      const Vector3d weight = variance.cwiseInverse() * ((kFreedom + 3.0) / (kFreedom + distance));
      information += weight;
      sum += weight.cwiseProduct(flight.mean);
      result.log_posterior -= 0.5 * variance.array().log().sum() +
                              0.5 * (kFreedom + 3.0) * std::log1p(distance / kFreedom);
    }
    const Vector3d moved = sum.cwiseQuotient(information) - mean;
    mean += moved;
    if (moved.norm() < kStandsStill * scale) break;
  }
  result.mean = mean;
  result.mean_variance = information.cwiseInverse().mean();
  result.log_posterior -= 0.5 * information.array().log().sum();  // mu integrated out
  const double ratio = scale / wide;
  result.log_posterior += std::log(ratio) - std::log1p(ratio * ratio);
  return result;
}

/** A mixture of Gaussians about zero, by the logarithm of their standard deviations. */
class ScaleMixture {
 public:
  /** @param least, most that a standard deviation can be */
  ScaleMixture(double least, double most)
      : first_(std::log(least)), step_((std::log(most) - first_) / (kBins - 1)), weights_(kBins) {}

  void add(double variance, double weight) {
    const double bin = std::clamp((0.5 * std::log(variance) - first_) / step_, 0.0, kBins - 1.0);
    weights_[std::lround(bin)] += weight;
  }

  /** What 99.73 % of it do not exceed, over three. */
  double coveringSigma() const {
    const double tail = std::erfc(3.0 / std::sqrt(2.0));
    double total = 0.0;
    for (const double weight : weights_) total += weight;
    double low = first_, high = first_ + kBins * step_ + 1.0;  // logarithms of the sigma
    for (int i = 0; i < 50; ++i) {
      const double middle = 0.5 * (low + high);
      double beyond = 0.0;
      for (int bin = 0; bin < kBins; ++bin)
        if (weights_[bin] > 0.0)
          beyond += weights_[bin] *
                    std::erfc(3.0 * std::exp(middle - first_ - bin * step_) / std::sqrt(2.0));
      (beyond > tail * total ? low : high) = middle;
    }
    return std::exp(high);
  }

 private:
  static constexpr int kBins = 400;
  double first_, step_;
  std::vector<double> weights_;
};

/** Adds a t distribution of that scale, plus a Gaussian. A t distribution is a Gaussian whose
 * variance is divided by a chi-square variable of as many degrees of freedom, a degree. */
void addT(double scale, double variance, double weight, ScaleMixture* mixture) {
  constexpr int kPoints = 48;
  constexpr double kLeast = 1e-3, kMost = 40.0;  // of chi-square; beyond are 1e-7 of it
  static_assert(kFreedom == 4.0, "the density below is that of four degrees of freedom");
  for (int i = 0; i < kPoints; ++i) {
    const double chi2 = kLeast * std::pow(kMost / kLeast, (i + 0.5) / kPoints);
    const double density = 0.25 * chi2 * std::exp(-0.5 * chi2);
    mixture->add(scale * scale * kFreedom / chi2 + variance, weight * density * chi2);
  }
}

Vector3d medianOf(const std::vector<SensorBias>& flights) {
  Vector3d result;
  for (int a = 0; a < 3; ++a) {
    std::vector<double> values;
    for (const SensorBias& flight : flights) values.push_back(flight.mean[a]);
    result[a] = quantile(std::move(values), 0.5);
  }
  return result;
}

}  // namespace

BiasPrediction predictBias(const std::vector<SensorBias>& flights, double wide) {
  BiasPrediction prediction;
  prediction.sigma = wide;
  if (flights.empty()) return prediction;
  constexpr int kScales = 300;
  constexpr double kLeast = 1e-4, kMost = 10.0;  // of `wide`
  const Vector3d start = medianOf(flights);
  std::vector<double> scales;
  std::vector<GivenScale> given;
  double largest = -std::numeric_limits<double>::infinity();
  for (int i = 0; i <= kScales; ++i) {
    scales.push_back(wide * kLeast * std::pow(kMost / kLeast, i / static_cast<double>(kScales)));
    given.push_back(givenScale(flights, scales.back(), wide, start));
    largest = std::max(largest, given.back().log_posterior);
  }
  std::vector<double> posterior;
  double total = 0.0;
  for (const GivenScale& each : given) {
    posterior.push_back(std::exp(each.log_posterior - largest));
    total += posterior.back();
  }
  double square = 0.0;
  Vector3d mean_square = Vector3d::Zero();
  for (int i = 0; i <= kScales; ++i) {
    const double p = posterior[i] /= total;
    prediction.mean += p * given[i].mean;
    mean_square += p * given[i].mean.cwiseAbs2();
    prediction.spread += p * scales[i];
    square += p * scales[i] * scales[i];
  }
  prediction.spread_sigma =
      std::sqrt(std::max(0.0, square - prediction.spread * prediction.spread));
  const double mean_variance = (mean_square - prediction.mean.cwiseAbs2()).cwiseMax(0.0).mean();
  double wander = 0.0;
  for (const SensorBias& flight : flights)
    wander += flight.wander * flight.wander / static_cast<double>(flights.size());
  prediction.wander = std::sqrt(wander);
  ScaleMixture mixture(kLeast * wide, 100.0 * kMost * wide);
  for (int i = 0; i <= kScales; ++i)
    addT(scales[i], given[i].mean_variance + mean_variance + wander, posterior[i], &mixture);
  // Few flights tell little of the tails; what two or more do tell may be more than `wide`.
  constexpr double kTails = 2.0;
  const double most = flights.size() > 1 ? std::max(wide, kTails * prediction.spread) : wide;
  prediction.sigma = std::min(most, mixture.coveringSigma());
  return prediction;
}

std::optional<BiasDrift> biasDrift(const std::vector<SensorBias>& flights,
                                   const std::vector<TimeNs>& stamps) {
  constexpr size_t kFewest = 4;  // two more than a line needs
  constexpr double kSecondsOfADay = 86'400.0;
  if (flights.size() < kFewest || flights.size() != stamps.size()) return std::nullopt;
  const auto [first, last] = std::minmax_element(stamps.begin(), stamps.end());
  BiasDrift drift;
  drift.days = secondsBetween(*first, *last) / kSecondsOfADay;
  if (!isDate(*first) || drift.days <= 1.0) return std::nullopt;
  std::vector<double> days;
  double mean_day = 0.0;
  Vector3d mean = Vector3d::Zero();
  const auto n = static_cast<double>(flights.size());
  for (size_t i = 0; i < flights.size(); ++i) {
    days.push_back(secondsBetween(*first, stamps[i]) / kSecondsOfADay);
    mean_day += days.back() / n;
    mean += flights[i].mean / n;
  }
  double leverage = 0.0;
  for (size_t i = 0; i < flights.size(); ++i) {
    leverage += (days[i] - mean_day) * (days[i] - mean_day);
    drift.per_day += (days[i] - mean_day) * (flights[i].mean - mean);
  }
  drift.per_day /= leverage;
  for (size_t i = 0; i < flights.size(); ++i)
    drift.sigma +=
        (flights[i].mean - mean - (days[i] - mean_day) * drift.per_day).cwiseAbs2() / (n - 2.0);
  drift.sigma = (drift.sigma / leverage).cwiseSqrt();
  return drift;
}

}  // namespace etalon
