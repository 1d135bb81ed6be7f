#include "etalon/pipeline/flight_bias.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace etalon {
namespace {

using Eigen::Vector3d;
using namespace state_index;

constexpr double kSettlingS = 10.0;
/** Between frames; longer are gaps and jumps of the clock, in which nothing settles. */
constexpr double kLongestStepS = 1.0;
constexpr double kLeastS = 10.0;
constexpr double kShareOfPrior = 0.5;
constexpr size_t kBatches = 10;

/** What the odometry said of a sensor's bias, frame by frame. What is known better counts more. */
struct Series {
  std::vector<Vector3d> values, variances;

  SensorBias summary() const {
    const Part all = part(0, values.size());
    SensorBias bias;
    bias.mean = all.mean;
    Vector3d scatter = Vector3d::Zero(), between = Vector3d::Zero();
    for (size_t i = 0; i < values.size(); ++i)
      scatter += (values[i] - all.mean).cwiseAbs2().cwiseQuotient(variances[i]);
    bias.wander = std::sqrt(scatter.cwiseQuotient(all.weight).mean());
    for (size_t b = 0; b < kBatches; ++b) {
      const Part batch = part(b * values.size() / kBatches, (b + 1) * values.size() / kBatches);
      between += (batch.mean - all.mean).cwiseAbs2().cwiseProduct(batch.weight);
    }
    // The batches' scatter, but no less than what the odometry says of a frame.
    const Vector3d claimed = static_cast<double>(values.size()) * all.weight.cwiseInverse();
    between = between.cwiseQuotient(all.weight) * (kBatches / (kBatches - 1.0));
    bias.sigma = (between.cwiseMax(claimed) / static_cast<double>(kBatches)).cwiseSqrt();
    return bias;
  }

 private:
  struct Part {
    Vector3d mean = Vector3d::Zero(), weight = Vector3d::Zero();
  };

  Part part(size_t from, size_t to) const {
    Part result;
    for (size_t i = from; i < to; ++i) {
      result.mean += values[i].cwiseQuotient(variances[i]);
      result.weight += variances[i].cwiseInverse();
    }
    result.mean = result.mean.cwiseQuotient(result.weight);
    return result;
  }
};

/** Standard deviation of the axis that is known worst. */
double worst(const Eigen::Matrix<double, 15, 1>& sigma, int block) {
  return sigma.segment<3>(block).maxCoeff();
}

}  // namespace

Expected<FlightBias> biasOfFlight(const std::vector<FrameEstimate>& estimates,
                                  const BiasPriors& priors) {
  const auto start = std::find_if(
      estimates.begin(), estimates.end(),
      [](const FrameEstimate& estimate) { return estimate.state == PipelineState::kInertial; });
  if (start == estimates.end())
    return refuse(RefusalStatus::kIllConditioned, "the inertial odometry never ran");
  FlightBias flight;
  Series gyro, accel;
  double settled_s = 0.0, best = std::numeric_limits<double>::infinity();
  for (auto frame = start; frame != estimates.end(); ++frame) {
    if (frame->state == PipelineState::kLost)
      return refuse(RefusalStatus::kIllConditioned, "the odometry was lost ",
                    Value(secondsBetween(start->t, frame->t), 1), " s after its start");
    if (frame->state != PipelineState::kInertial || secondsBetween(start->t, frame->t) < kSettlingS)
      continue;
    const Eigen::Matrix<double, 15, 1> sigma = frame->sigma();
    best = std::min(best, worst(sigma, kAccelBias));
    if (!(worst(sigma, kGyroBias) <= kShareOfPrior * priors.sigma_gyro_rps) ||
        !(worst(sigma, kAccelBias) <= kShareOfPrior * priors.sigma_accel_mps2))
      continue;
    if (gyro.values.empty()) flight.first = frame->t;
    const double step_s = secondsBetween((frame - 1)->t, frame->t);
    if (step_s <= kLongestStepS) settled_s += step_s;
    flight.last = frame->t;
    gyro.values.push_back(frame->nav.bias.gyro);
    gyro.variances.push_back(sigma.segment<3>(kGyroBias).cwiseAbs2());
    accel.values.push_back(frame->nav.bias.accel);
    accel.variances.push_back(sigma.segment<3>(kAccelBias).cwiseAbs2());
  }
  if (!(settled_s >= kLeastS) || gyro.values.size() < 2 * kBatches) {
    std::string known;
    const double wanted = kShareOfPrior * priors.sigma_accel_mps2;
    if (std::isfinite(best) && !(best <= wanted))
      known = "; b_a was known to " + Number(best).text +
              " m/s^2 at best, half of the prior's is " + Number(wanted).text;
    return refuse(RefusalStatus::kTooFewKeyframes, "the biases were settled for ",
                  Value(settled_s, 1), " s, at least ", Bound(kLeastS, 0),
                  " s are wanted, from " + Number(kSettlingS, 0).text + " s after the start on",
                  known);
  }
  flight.gyro = gyro.summary();
  flight.accel = accel.summary();
  return flight;
}

}  // namespace etalon
