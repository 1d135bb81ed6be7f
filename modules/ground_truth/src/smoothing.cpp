#include "etalon/ground_truth/smoothing.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <utility>

#include "corrected.h"
#include "etalon/core/so3.h"
#include "etalon/core/statistics.h"
#include "size_search.h"
#include "standard_errors.h"

namespace etalon {
namespace {

using namespace ground_truth;  // NOLINT(google-build-using-namespace): this is its front

/** Rows this close to the ends of the IMU are left out: a shift must not lead past them, s. */
constexpr double kMarginS = 0.3;
constexpr double kShortestS = 10.0;
constexpr size_t kFewestRows = 20;
/** Gauss-Newton steps from the recorded poses, and after every search for the sizes. */
constexpr int kFirstSteps = 4, kLaterSteps = 2;
constexpr int kMostSearches = 3;
/** Searching again moves a logarithm by less than this: it is over. */
constexpr double kSizesSettled = 0.02;
/** A bandwidth that lets everything pass, Hz. */
constexpr double kAllHz = 1e6;
/** A low pass must make the rows likelier by a factor of e to this. */
constexpr double kWorthOfLowPass = 3.0;
/** Rows that are this many usual steps apart have a gap between them. */
constexpr double kGapSteps = 3.0;

/** First row that is not finite or not later than the one before it; the number of rows if none. */
size_t firstBroken(const std::vector<StampedState>& rows) {
  for (size_t k = 0; k < rows.size(); ++k) {
    const SE3& pose = rows[k].T_WB;
    if (!pose.R.allFinite() || !pose.t.allFinite()) return k;
    if (k > 0 && rows[k].t <= rows[k - 1].t) return k;
  }
  return rows.size();
}

/** Rows within the IMU's time and outside its gaps. */
std::vector<StampedState> coveredRows(const GroundTruth& recorded,
                                      const std::vector<ImuSample>& imu) {
  std::vector<StampedState> rows;
  if (imu.empty()) return rows;
  const TimeNs from = imu.front().t + durationNs(kMarginS);
  const TimeNs to = imu.back().t - durationNs(kMarginS);
  size_t next = 1;
  for (const StampedState& row : recorded.states) {
    if (row.t < from || to < row.t) continue;
    while (imu[next].t < row.t) ++next;
    if (secondsBetween(imu[next - 1].t, imu[next].t) <= kMaxImuGapS) rows.push_back(row);
  }
  return rows;
}

std::vector<GroundTruthGap> gapsOf(const std::vector<StampedState>& rows) {
  std::vector<double> steps;
  for (size_t k = 1; k < rows.size(); ++k)
    steps.push_back(secondsBetween(rows[k - 1].t, rows[k].t));
  const double usual = median(steps);
  std::vector<GroundTruthGap> gaps;
  for (size_t k = 1; k < rows.size(); ++k)
    if (steps[k - 1] > kGapSteps * usual) gaps.push_back({rows[k - 1].t, steps[k - 1]});
  return gaps;
}

/** False if the equations cannot be solved. */
bool gaussNewton(FlightModel* model, const SizeVector& sizes, const SizePriors& priors, int steps) {
  for (int i = 0; i < steps; ++i) {
    const Linearisation linear = model->linearise();
    Posterior posterior;
    if (!Likelihood(linear, priors).solve(sizes, &posterior)) return false;
    model->add(posterior.nodes, posterior.border);
  }
  return true;
}

/** A flight fitted with the sizes of its errors. */
struct Fit {
  FlightModel model;
  SizePriors priors;
  SizeVector log_sizes;
  double objective = 0.0;
};

int lowPasses(const Fit& fit) {
  return (fit.priors[kPositionBandwidth].log_sigma > 0.0) +
         (fit.priors[kRotationBandwidth].log_sigma > 0.0);
}

/** Sizes and flight in turn. Nothing if the equations cannot be solved. */
std::optional<Fit> fitted(Fit fit) {
  const SizePriors& priors = fit.priors;
  if (!gaussNewton(&fit.model, fit.log_sizes, priors, kFirstSteps)) return std::nullopt;
  for (int i = 0; i < kMostSearches; ++i) {
    const Linearisation linear = fit.model.linearise();
    Likelihood likelihood(linear, priors);
    const SizeVector before = fit.log_sizes;
    fit.log_sizes = searchSizes(&likelihood, fit.log_sizes).log_sizes;
    if (!gaussNewton(&fit.model, fit.log_sizes, priors, kLaterSteps)) return std::nullopt;
    if ((fit.log_sizes - before).cwiseAbs().maxCoeff() < kSizesSettled) break;
  }
  const Linearisation linear = fit.model.linearise();
  Posterior posterior;
  if (!Likelihood(linear, priors).solve(fit.log_sizes, &posterior)) return std::nullopt;
  fit.objective = posterior.objective;
  return fit;
}

/** Whether the rows follow a tracker up to a bandwidth only is for the likelihood to say, of
 * positions and rotations by themselves. The first fit is the one without low passes. */
std::optional<std::pair<Fit, Fit>> plainAndBest(const FlightModel& model) {
  std::optional<Fit> plain, best;
  for (const bool low_positions : {false, true}) {
    for (const bool low_rotations : {false, true}) {
      SizePriors priors = defaultSizePriors();
      if (!low_positions) priors[kPositionBandwidth] = {kAllHz, 0.0};
      if (!low_rotations) priors[kRotationBandwidth] = {kAllHz, 0.0};
      Fit start = plain ? *plain : Fit{model, priors, logOf(priors)};
      for (const int index : {kPositionBandwidth, kRotationBandwidth})
        start.log_sizes[index] = std::log(priors[index].value);
      start.priors = priors;
      std::optional<Fit> next = fitted(std::move(start));
      if (!next) continue;
      if (!low_positions && !low_rotations) plain = next;
      const double worth = kWorthOfLowPass * (low_positions + low_rotations);
      const double cost = best ? best->objective + kWorthOfLowPass * lowPasses(*best) : 0.0;
      if (!best || next->objective + worth < cost) best = std::move(next);
    }
  }
  if (!plain || !best) return std::nullopt;
  return std::make_pair(std::move(*plain), std::move(*best));
}

/** What is known of a fit's unknowns. */
struct Analysis {
  SizeUncertainty sizes;
  BorderEstimate border;
  size_t believed = 0;
  int blocks = 0;

  Analysis(const Fit& fit, double block_s) {
    const Linearisation linear = fit.model.linearise();
    Likelihood likelihood(linear, fit.priors);
    const std::vector<size_t> begins = blocksOf(linear.nodes, block_s);
    sizes = sizeUncertainty(&likelihood, fit.log_sizes, begins);
    border =
        estimateBorder(&likelihood, fit.log_sizes, begins,
                       sizes.border_by_size * sizes.covariance * sizes.border_by_size.transpose());
    believed = likelihood.believedRows();
    blocks = static_cast<int>(begins.size());
  }
};

Measured measured(double value, double variance) { return {value, std::sqrt(variance)}; }

BodyOffset bodyOffset(const Shared& at, const BorderEstimate& estimate) {
  const BorderMatrix& P = estimate.covariance;
  const auto of = [&](double before, int index) {
    return measured(before + estimate.move[index], P(index, index));
  };
  BodyOffset offset;
  offset.position_shift_s = of(at.position_shift_s, kPositionShift);
  offset.rotation_shift_s = of(at.rotation_shift_s, kRotationShift);
  offset.turn_rad.value = logSO3(at.R_BM * expSO3(estimate.move.segment<3>(kTurn)));
  offset.lever_m.value = at.lever_B + estimate.move.segment<3>(kLever);
  offset.turn_rad.sigma = P.diagonal().segment<3>(kTurn).cwiseSqrt();
  offset.lever_m.sigma = P.diagonal().segment<3>(kLever).cwiseSqrt();

  const Eigen::Vector2d shifts(offset.position_shift_s.value, offset.rotation_shift_s.value);
  const Eigen::Matrix2d C = P.topLeftCorner<2, 2>();
  const double det = C(0, 0) * C(1, 1) - C(0, 1) * C(0, 1);
  Eigen::Matrix2d W;
  W << C(1, 1), -C(0, 1), -C(0, 1), C(0, 0);
  W /= det;
  offset.common_shift_s = measured((W * shifts).sum() / W.sum(), 1.0 / W.sum());
  offset.shifts_differ_sigmas =
      std::abs(shifts[0] - shifts[1]) / std::sqrt(C(0, 0) + C(1, 1) - 2.0 * C(0, 1));
  return offset;
}

void setGravity(const Shared& at, const BorderEstimate& estimate, GroundTruthSmoothing* result) {
  const Eigen::Vector3d g = at.g_G + estimate.move.segment<3>(kGravity);
  const double norm = g.norm();
  result->gravity_mps2 = norm;
  const auto sigma2 = [&](int axis) {
    return estimate.covariance(kGravity + axis, kGravity + axis) / (norm * norm);
  };
  result->gravity_x_rad = measured(g.x() / norm, sigma2(0));
  result->gravity_y_rad = measured(g.y() / norm, sigma2(1));
  const Eigen::Vector2d across = g.head<2>() / norm;
  const double tilt = angleBetween(g, -Eigen::Vector3d::UnitZ());
  const Eigen::Vector2d u = across.norm() > 0.0 ? across.normalized() : Eigen::Vector2d::UnitX();
  result->tilt_rad = measured(
      tilt, u.dot(estimate.covariance.block<2, 2>(kGravity, kGravity) * u) / (norm * norm));
}

void setSizes(const Fit& fit, const SizeUncertainty& uncertainty, GroundTruthSmoothing* result) {
  const auto of = [&](int index) {
    if (fit.priors[index].log_sigma == 0.0)
      return Measured{std::numeric_limits<double>::infinity(), 0.0};
    const double value = std::exp(fit.log_sizes[index]);
    const double variance =
        std::max(uncertainty.covariance(index, index), uncertainty.robust(index, index));
    return Measured{value, value * std::sqrt(variance)};
  };
  result->position_error = {of(kPositionWhite), of(kPositionCorrelated), of(kPositionTime)};
  result->rotation_error = {of(kRotationWhite), of(kRotationCorrelated), of(kRotationTime)};
  result->position_bandwidth_hz = of(kPositionBandwidth);
  result->rotation_bandwidth_hz = of(kRotationBandwidth);
  result->imu = {of(kGyroNoiseFactor), of(kGyroWalkFactor), of(kAccelNoiseFactor),
                 of(kAccelWalkFactor)};
}

}  // namespace

Expected<GroundTruthSmoothing> smoothGroundTruth(const GroundTruth& recorded,
                                                 const std::vector<ImuSample>& imu,
                                                 const ImuNoiseDensities& data_sheet,
                                                 const GroundTruthSmoothingOptions& options) {
  if (const size_t broken = firstBroken(recorded.states); broken < recorded.states.size())
    return refuse(RefusalStatus::kInvalidInput, "row ", Value(broken + 1),
                  " of the ground truth is not finite or not later than the one before it");
  const std::vector<StampedState> rows = coveredRows(recorded, imu);
  if (rows.size() < kFewestRows)
    return refuse(RefusalStatus::kImuGap, Value(rows.size()),
                  " rows of the ground truth are within the IMU's time, at least ",
                  Bound(kFewestRows), " are wanted");
  const double length_s = secondsBetween(rows.front().t, rows.back().t);
  if (length_s < kShortestS)
    return refuse(RefusalStatus::kInvalidInput, "the ground truth within the IMU's time is ",
                  Value(length_s), " s long, at least ", Bound(kShortestS), " s are wanted");

  const ImuBuffer buffer(imu);
  const auto fits =
      plainAndBest(FlightModel(rows, buffer, data_sheet, options.step_s, options.row_step_s));
  if (!fits)
    return refuse(RefusalStatus::kNotConverged,
                  "ground truth and IMU do not fit together: the equations cannot be solved");
  const auto& [plain, best] = *fits;

  GroundTruthSmoothing result;
  const Analysis analysis(best, options.block_s);
  result.offset = bodyOffset(best.model.shared(), analysis.border);
  result.plain_offset = lowPasses(best) == 0 ? result.offset
                                             : bodyOffset(plain.model.shared(),
                                                          Analysis(plain, options.block_s).border);
  setGravity(best.model.shared(), analysis.border, &result);
  setSizes(best, analysis.sizes, &result);
  result.rows = rows.size();
  result.believed = analysis.believed;
  result.length_s = length_s;
  result.gaps = gapsOf(rows);
  result.blocks = analysis.blocks;
  result.corrected =
      correctedStates(best.model.nodes(), best.model.shared(), buffer, options.max_bridged_gap_s);
  return result;
}

}  // namespace etalon
