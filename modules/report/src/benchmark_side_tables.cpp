#include "benchmark_side_tables.h"

#include <algorithm>
#include <cmath>
#include <map>

#include "etalon/benchmark/calibration/noise_calibration.h"
#include "etalon/core/text.h"

namespace etalon {
namespace {

/** The attempt's times by part, each with its name for the reader. */
std::vector<std::pair<std::string, double>> partsOf(const AttemptRecord& attempt) {
  std::vector<std::pair<std::string, double>> parts;
  double total = 0.0;
  for (const StageTiming& timing : attempt.timings) {
    const bool odometry = timing.stage == kTimingStereoOdometry,
               vi_ba = timing.stage == kTimingViBa;
    const bool whole = timing.stage == kTimingInitialize;
    if (odometry || vi_ba || whole) total += timing.milliseconds;
    parts.emplace_back(odometry ? "stereo odometry"
                       : whole  ? "initializer"
                       : vi_ba  ? "VI-BA"
                                : "initializer: " + timing.stage,
                       timing.milliseconds);
  }
  parts.emplace_back("all together", total);
  return parts;
}

/** The check of one sequence, summed over the windows of an initializer. */
struct SequenceNoise {
  int windows = 0;
  NoiseCheck check;
};

SequenceNoise noiseOf(const BenchmarkRecord& record, const WindowShape& shape,
                      const std::string& sequence, const std::string& initializer) {
  SequenceNoise sum;
  for (const WindowResult& result : record.results) {
    if (!result.noise || result.initializer != initializer || result.shape() != shape ||
        (sequence != kAllSequences && result.sequence != sequence))
      continue;
    ++sum.windows;
    sum.check += *result.noise;
  }
  return sum;
}

void setVerdict(Table* table, const std::string& sensor, const ResidualGroup& residuals,
                double factor) {
  const NoiseVerdict verdict = noiseVerdict(residuals, factor);
  table->setNumber(sensor + "_chi2_per_dof", verdict.chi2_per_dof);
  table->setText(sensor + "_noise", verdict.words);
  table->setNumber(sensor + "_factor", verdict.factor);
}

/** Names the recordings whose ground truth copies the gyro's rotations; empty if none does. */
std::string copiesNote(const BenchmarkRecord& record) {
  std::vector<std::string> names;
  double most = 0.0;
  for (const BenchmarkSequence& sequence : record.sequences) {
    if (!sequence.gyro_agreement.isCopy()) continue;
    names.push_back(sequence.name);
    most = std::max(most, sequence.gyro_agreement.median);
  }
  if (names.empty()) return "";
  const std::string text = format(
      " the ground truth's rotations are the smoothed gyro (from state to state they "
      "agree with it to %.2g of its white noise): RRE there flatters whoever copies the "
      "gyro.",
      most);
  return " In " + joined(names) + text;
}

}  // namespace

std::string nameOf(SummaryStatistic statistic) {
  switch (statistic) {
    case SummaryStatistic::kMean:
      return "mean";
    case SummaryStatistic::kMedian:
      return "median";
    case SummaryStatistic::kP90:
      break;
  }
  return "90th percentile";
}

double valueOf(const FigureSummary& figure, SummaryStatistic statistic) {
  switch (statistic) {
    case SummaryStatistic::kMean:
      return figure.mean;
    case SummaryStatistic::kMedian:
      return figure.median;
    case SummaryStatistic::kP90:
      break;
  }
  return figure.p90;
}

std::string shapeText(const WindowShape& shape) {
  return format("%d keyframes at %g Hz", shape.keyframes, shape.rate_hz);
}

std::string shapeId(const WindowShape& shape) {
  return format("_%d_%ghz", shape.keyframes, shape.rate_hz);
}

NoiseVerdict noiseVerdict(const ResidualGroup& residuals, double factor) {
  NoiseVerdict verdict;
  if (!(residuals.dof > 0.0)) return verdict;
  verdict.chi2_per_dof = residuals.chi2 / residuals.dof;
  verdict.factor = std::isnan(factor) ? std::sqrt(verdict.chi2_per_dof) : factor;
  verdict.words = verdict.factor > kNoiseTolerance         ? "too small"
                  : verdict.factor < 1.0 / kNoiseTolerance ? "too large"
                                                           : "about right";
  return verdict;
}

TitledTable runtimePartsTable(const BenchmarkRecord& record, const WindowShape& shape) {
  Table table({{"initializer", "initializer"},
               {"part", "part"},
               {"windows", "windows", true, 0},
               {"mean_ms", "mean [ms]", true, 2},
               {"median_ms", "median [ms]", true, 2},
               {"p90_ms", "90th percentile [ms]", true, 2}});
  for (const std::string& initializer : initializersOf(record)) {
    std::vector<std::string> names;  // in the order of their first appearance
    std::map<std::string, std::vector<double>> times;
    for (const WindowResult& result : record.results) {
      if (result.initializer != initializer || result.shape() != shape) continue;
      for (const auto& [name, ms] : partsOf(result.attempt)) {
        if (times.count(name) == 0) names.push_back(name);
        times[name].push_back(ms);
      }
    }
    for (const std::string& name : names) {
      const FigureSummary figure = summaryOf(times[name]);
      table.addRow();
      table.setText("initializer", initializer);
      table.setText("part", name);
      table.setNumber("windows", figure.count);
      table.setNumber("mean_ms", figure.mean);
      table.setNumber("median_ms", figure.median);
      table.setNumber("p90_ms", figure.p90);
    }
  }
  TitledTable titled = {
      "runtime_parts" + shapeId(shape), "Run time by part [ms], all sequences, " + shapeText(shape),
      "Over the windows in which the part ran, refused ones included.", std::move(table)};
  titled.metric = "runtime_parts";
  titled.keyframes = shape.keyframes;
  titled.rate_hz = shape.rate_hz;
  return titled;
}

std::string checkedInitializer(const BenchmarkRecord& record, const WindowShape& shape) {
  const auto checked = std::find_if(
      record.results.begin(), record.results.end(),
      [&](const WindowResult& result) { return result.noise && result.shape() == shape; });
  return checked == record.results.end() ? "" : checked->initializer;
}

std::optional<TitledTable> noiseTable(const BenchmarkRecord& record, const WindowShape& shape) {
  const std::string initializer = checkedInitializer(record, shape);
  if (initializer.empty()) return std::nullopt;
  std::vector<Table::Column> columns = {{"sequence", "sequence"}, {"windows", "windows", true, 0}};
  for (const auto& [key, name] : {std::pair<std::string, std::string>{"gyro", "gyroscope"},
                                  {"accel", "accelerometer"},
                                  {"vision", "pixels"}}) {
    columns.push_back({key + "_chi2_per_dof", "chi2/dof", true, 2, 1.0, false, name});
    columns.push_back({key + "_noise", "noise in use", false, 0, 1.0, false, name});
    columns.push_back({key + "_factor", "one step", true, 2, 1.0, false, name});
  }
  Table table(columns);
  std::vector<std::string> sequences = sequencesOf(record);
  sequences.emplace_back(kAllSequences);
  for (const std::string& sequence : sequences) {
    const SequenceNoise sum = noiseOf(record, shape, sequence, initializer);
    if (sequence == kAllSequences) table.addRule();
    table.addRow();
    table.setText("sequence", sequence);
    table.setNumber("windows", sum.windows);
    const Eigen::Vector3d factor = correctionOf(sum.check).factor;
    setVerdict(&table, "gyro", sum.check.gyro, factor[0]);
    setVerdict(&table, "accel", sum.check.accel, factor[1]);
    setVerdict(&table, "vision", sum.check.vision, factor[2]);
  }
  TitledTable titled = {
      "noise" + shapeId(shape),
      "Check of the noise, VI-BA after " + initializer + ", " + shapeText(shape),
      "chi2/dof is 1 where all noise in use is right. One step: the factor of the first step "
      "of the variance components, with the others' noise as configured; too small and too large "
      "are more "
      "than a factor of " +
          format("%g", kNoiseTolerance) +
          " off by it. It shows that the noise does not fit, not what fits: where another sensor's "
          "noise is wrong its size and even its direction are. `etalon calibrate-device` iterates.",
      std::move(table), true};
  titled.metric = "noise";
  titled.keyframes = shape.keyframes;
  titled.rate_hz = shape.rate_hz;
  return titled;
}

std::string boundNote(const BenchmarkRecord& record, const std::string& key) {
  if (key == "rre_deg")
    return " Lower bound, gyro alone: the least that integrating the gyro can have, with the bias "
           "that "
           "fits the window's ground truth best, over all windows; rotations that vision has a "
           "part "
           "in may be better; none where windows grow." +
           copiesNote(record);
  if (key == "gyro_bias_rps")
    return " Lower bound, ground truth: the gyro bias that fits the window's true rotations best, "
           "against the one that the ground truth states, over all windows (none where windows "
           "grow). Where errors equal it, "
           "they measure the ground truth's bias, not the estimate's; whether the covariance of "
           "b_g is right is judged on simulation (covariance.consistent of etalon check-plugin).";
  return " Tilt: of the ground truth's world against gravity.";
}

TitledTable groundTruthTable(const BenchmarkRecord& record) {
  const bool problems =
      std::any_of(record.sequences.begin(), record.sequences.end(),
                  [](const BenchmarkSequence& sequence) { return !sequence.error.empty(); });
  Table table({{"sequence", "sequence"},
               {"duration_s", "duration [s]", true, 1},
               {"stereo_frames", "stereo frames", true, 0},
               {"ground_truth", "ground truth"},
               {"interval_s", "interval [s]", true, 2, 1.0, true},
               {"rre_deg", "RRE [deg]", true, 4},
               {"world_tilt_deg", "tilt [deg]", true, 3},
               {"gyro_bias_rps", "gyro bias [rad/s]", true, 4},
               {"accel_bias_mps2", "accel bias [m/s2]", true, 3},
               {"truth_gyro_median", "median", true, 2, 1.0, false, "truth less gyro"},
               {"truth_gyro_rms", "rms", true, 2, 1.0, false, "truth less gyro"},
               {"error", "problem", false, 0, 1.0, !problems}});
  for (const BenchmarkSequence& sequence : record.sequences) {
    table.addRow();
    table.setText("sequence", sequence.name);
    table.setNumber("duration_s", sequence.duration_s);
    table.setNumber("stereo_frames", sequence.stereo_frames);
    table.setText("ground_truth", sequence.has_ground_truth ? "yes" : "none");
    table.setText("error", sequence.error);
    if (!sequence.has_ground_truth) continue;
    const GroundTruthCheck& check = sequence.ground_truth_check;
    table.setNumber("interval_s", check.interval_s);
    table.setNumber("rre_deg", check.rre_deg);
    table.setNumber("world_tilt_deg", check.world_tilt_deg);
    table.setNumber("truth_gyro_median", sequence.gyro_agreement.median);
    table.setNumber("truth_gyro_rms", sequence.gyro_agreement.rms);
    if (std::isnan(check.rre_deg)) continue;
    table.setNumber("gyro_bias_rps", check.bias.gyro.norm());
    table.setNumber("accel_bias_mps2", check.bias.accel.norm());
  }
  TitledTable titled = {
      "ground_truth", "Ground truth against the IMU",
      "The ground truth against the recording's own IMU: rotation over a quarter of a second "
      "against the gyro's, with one constant bias for the whole recording; tilt of its world "
      "against gravity; norms of the constant biases that fit best. It describes the "
      "recording: with a bias of its own every window can be better (the lower bound "
      "beside RRE). Truth less gyro: rotation from one state to the next, 1 is the gyro's white "
      "noise; an independent truth has 0.7 at least.",
      std::move(table), true};
  titled.metric = "ground_truth";
  return titled;
}

}  // namespace etalon
