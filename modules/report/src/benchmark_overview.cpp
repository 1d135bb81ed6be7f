#include "etalon/report/benchmark_overview.h"

#include <algorithm>
#include <cmath>

#include "benchmark_side_tables.h"
#include "etalon/benchmark/windows.h"
#include "etalon/core/statistics.h"
#include "etalon/core/text.h"
#include "etalon/core/time.h"

namespace etalon {
namespace {

constexpr const char* kRuntime = "runtime_ms";

/** A column's title where the unit stands in the note. */
std::string shortTitle(const std::string& figure) {
  if (figure == kSuccessRate) return "succ.";
  if (figure == "rre_deg") return "RRE";
  if (figure == "ate_m") return "ATE";
  if (figure == "gravity_deg") return "grav.";
  if (figure == "velocity_mps") return "v";
  return "time";
}

/** After VI-BA all initializers give nearly the same poses, in the same time: RRE, ATE and time stand
 * without it alone. */
std::vector<std::string> figuresOf(const std::string& stage) {
  if (stage == kStageInit)
    return {kSuccessRate, "rre_deg", "ate_m", "gravity_deg", "velocity_mps", kRuntime};
  return {kSuccessRate, "gravity_deg", "velocity_mps"};
}

std::string keyOf(const std::string& figure, const std::string& stage) {
  return figure + "_" + stage;
}

Table::Column columnOf(const std::string& figure, const std::string& stage) {
  Table::Column column{keyOf(figure, stage), shortTitle(figure), true};
  column.group = groupOf(stage);
  if (figure == kSuccessRate) {
    column.decimals = kSuccessDecimals;
    column.factor = 100.0;
  } else if (figure == kRuntime) {
    column.decimals = 2;
  } else {
    const WindowMetric metric = windowMetric(figure);
    column.decimals = figure == "gravity_deg" ? 2 : metric.decimals;
    column.factor = metric.factor;
  }
  return column;
}

double valueOf(const SummaryRow& row, const std::string& figure) {
  if (figure == kSuccessRate) return row.success_rate;
  if (figure == kRuntime) {  // what a start costs
    const double odometry_ms =
        row.stereo_odometry_ms.count > 0 ? row.stereo_odometry_ms.median : 0.0;
    return row.runtime_ms.median + odometry_ms;
  }
  const std::vector<WindowMetric> metrics = windowMetrics();
  for (size_t m = 0; m < metrics.size(); ++m)
    if (metrics[m].key == figure) return row.errors[m].median;
  return WindowErrors::kNone;
}

/** Breaks the text's blanks so that lines have at most kLine characters, where words allow it. */
std::string brokenIntoLines(std::string text) {
  constexpr size_t kLine = 100;
  for (size_t begin = 0, blank = text.find_first_of(" \n"); blank != std::string::npos;) {
    const size_t next = text.find_first_of(" \n", blank + 1);
    const size_t end = next == std::string::npos ? text.size() : next;
    if (end - begin > kLine) text[blank] = '\n';
    if (text[blank] == '\n') begin = blank + 1;
    blank = next;
  }
  return text;
}

/** Such as "V1 at 12.5 s: velocity [0.031 m/s]; V1 at 15.0 s: no success"; seconds since the
 * recording's first image. In brackets: WindowTruthCheck::velocity_step_mps. */
struct FalseAcceptList {
  std::string text;
  bool has_steps = false;  ///< something stands in brackets
};

/** Of the initializer's false accepts that the summary counts. */
FalseAcceptList listOfFalseAccepts(const BenchmarkRecord& record, const WindowShape& shape,
                                   const std::string& initializer, const std::string& stage) {
  constexpr size_t kMost = 3;
  FalseAcceptList list;
  std::vector<std::string> windows;
  const std::vector<std::optional<bool>> success = judgedSuccess(record, stage);
  for (size_t i = 0; i < record.results.size(); ++i) {
    const WindowResult& result = record.results[i];
    if (!success[i] || result.initializer != initializer || result.shape() != shape) continue;
    const std::string reason = windowRow(result, stage).falseAcceptReason().value_or("");
    if (reason.empty()) continue;
    if (windows.size() == kMost) {
      windows.emplace_back("...");
      break;
    }
    TimeNs first_image = 0;
    for (const BenchmarkSequence& sequence : record.sequences)
      if (sequence.name == result.sequence) first_image = sequence.first_image;
    windows.push_back(result.sequence +
                      format(" at %.1f s: ", secondsBetween(first_image, result.t0)) + reason);
    const double step = result.truth_check.velocity_step_mps;
    if (std::isnan(step)) continue;
    windows.back() += format(" [%.3f m/s]", step);
    list.has_steps = true;
  }
  list.text = joined(windows, "; ");
  return list;
}

/** What stands in brackets behind a false accept; of windows that grow every initializer has its own,
 * without a median. */
std::string explanationOfSteps(const BenchmarkRecord& record, const WindowShape& shape) {
  const FigureSummary steps =
      truthCheck(record, shape, kAllSequences, &WindowTruthCheck::velocity_step_mps);
  std::string text =
      "In brackets: largest step of the ground truth's velocity that the accelerometer did not "
      "feel";
  if (steps.count > 0) text += format(" (median of all windows: %.3f m/s)", steps.median);
  return text + ".\n";
}

/** How many there are, and of the initializer that has the most of them which ones; a line or more,
 * if there is one. */
std::string noteOnFalseAccepts(const BenchmarkRecord& record, const WindowShape& shape,
                               const std::vector<const SummaryRow*>& rows) {
  int count = 0, tried = 0;
  const SummaryRow* worst = nullptr;
  bool alone = true;  // no other initializer has as many
  for (const SummaryRow* row : rows) {
    ++tried;
    count += row->false_accepts;
    if (worst && row->false_accepts == worst->false_accepts) alone = false;
    if (worst && row->false_accepts <= worst->false_accepts) continue;
    worst = row;
    alone = true;
  }
  if (count == 0) return "No false accept. ";
  const FalseAcceptList list = listOfFalseAccepts(record, shape, worst->initializer, worst->stage);
  std::string note = "False accepts: " + std::to_string(count);
  if (tried == 1)
    note += " (" + list.text + ")";
  else if (worst->false_accepts == count)
    note += (count == 1 ? " by " : ", all by ") + worst->initializer + ": " + list.text;
  else
    note += (alone ? ", most by " : ", for example by ") + worst->initializer + " (" +
            std::to_string(worst->false_accepts) + "): " + list.text;
  return note + ".\n" + (list.has_steps ? explanationOfSteps(record, shape) : "");
}

/** Below the table: what the columns are, what VI-BA takes, and who accepted what is not good. */
std::string noteOn(const BenchmarkRecord& record, const WindowShape& shape,
                   const std::vector<const SummaryRow*>& rows) {
  const std::string last_stage = stagesOf(record).back();
  int windows = 0, judged = 0;
  std::vector<const SummaryRow*> last;
  std::vector<double> vi_ba_ms;
  for (const SummaryRow* row : rows) {
    windows = row->count;
    judged = std::max(judged, row->judged);
    if (row->stage == kStageViBa && row->runtime_ms.count > 0)
      vi_ba_ms.push_back(row->runtime_ms.median);
    if (row->stage == last_stage) last.push_back(row);
  }
  std::string note = std::to_string(windows) + " windows. ";
  note += judged == 0 ? "None can be judged without ground truth. "
                      : noteOnFalseAccepts(record, shape, last);
  note = brokenIntoLines(note);
  note +=
      "succ.: success [%]. Medians: RRE, gravity [deg],\nATE [mm], velocity [m/s], time [ms] with "
      "the "
      "stereo odometry that is asked for";
  if (vi_ba_ms.empty()) return note + ". ";
  return note + format(";\nVI-BA itself takes %.0f ms.\n", quantile(vi_ba_ms, 0.5));
}

std::vector<size_t> rowsThatCanBeBest(const std::vector<const SummaryRow*>& rows,
                                      const std::string& stage,
                                      const std::vector<std::string>& initializers) {
  std::vector<size_t> chosen;
  for (const SummaryRow* row : rows)
    if (row->stage == stage && canBeBest(*row))
      chosen.push_back(std::find(initializers.begin(), initializers.end(), row->initializer) -
                       initializers.begin());
  return chosen;
}

const char* shownVerdict(const PairedComparison& c) {
  if (c.apart < kMinPairs) return "few";
  const std::string verdict = c.verdict();
  if (verdict.rfind(c.b + " is better", 0) == 0) return "better";
  return verdict.rfind(c.a + " is better", 0) == 0 ? "worse" : "=";
}

}  // namespace

std::vector<std::string> overviewFigures() {
  return {kSuccessRate, "rre_deg", "ate_m", "gravity_deg", "velocity_mps"};
}

TitledTable overviewTable(const BenchmarkRecord& record, const std::vector<SummaryRow>& summary,
                          const WindowShape& shape) {
  const std::vector<std::string> stages = stagesOf(record);
  std::vector<Table::Column> columns = {{"initializer", "initializer"}};
  for (const std::string& stage : stages)
    for (const std::string& figure : figuresOf(stage)) columns.push_back(columnOf(figure, stage));
  Table table(columns);
  std::vector<const SummaryRow*> rows;
  const std::vector<std::string> initializers = initializersOf(record);
  for (const std::string& initializer : initializers) {
    table.addRow();
    table.setText("initializer", initializer);
    for (const SummaryRow& row : summary) {
      if (row.sequence != kAllSequences || row.keyframes != shape.keyframes ||
          row.rate_hz != shape.rate_hz || row.initializer != initializer ||
          row.which != kAllWindows)
        continue;
      rows.push_back(&row);
      for (const std::string& figure : figuresOf(row.stage))
        table.setNumber(keyOf(figure, row.stage), valueOf(row, figure));
    }
  }
  for (const std::string& stage : stages)
    for (const std::string& figure : figuresOf(stage))
      table.markBestOfColumn(keyOf(figure, stage), rowsThatCanBeBest(rows, stage, initializers),
                             figure != kSuccessRate);
  TitledTable overview{
      "overview" + shapeId(shape),
      std::to_string(sequencesOf(record).size()) + " recordings, " + shapeText(shape), "",
      std::move(table)};
  if (sequencesOf(record).size() == 1)
    overview.title = sequencesOf(record).front() + ", " + shapeText(shape);
  const std::vector<std::string> absent = tooShort(record, shape);
  if (!absent.empty()) overview.note = "Not in the table: " + joined(absent, "; ") + ".\n";
  overview.note += noteOn(record, shape, rows);
  overview.marks_best = true;
  overview.keyframes = shape.keyframes;
  overview.rate_hz = shape.rate_hz;
  return overview;
}

TitledTable comparisonOverview(const std::vector<PairedComparison>& comparisons,
                               const BootstrapOptions& options) {
  std::vector<Table::Column> columns = {{"initializer", "initializer"}};
  for (const PairedComparison& c : comparisons) {
    Table::Column column{keyOf(c.figure, c.stage), shortTitle(c.figure)};
    column.group = groupOf(c.stage);
    const auto same = [&](const Table::Column& other) { return other.key == column.key; };
    if (std::none_of(columns.begin(), columns.end(), same)) columns.push_back(column);
  }
  Table table(columns);
  std::string last;
  int few = 0;
  for (const PairedComparison& c : comparisons) {
    if (c.b != last) {
      table.addRow();
      table.setText("initializer", c.b);
      last = c.b;
    }
    table.setText(keyOf(c.figure, c.stage), shownVerdict(c));
    few += c.apart < kMinPairs;
  }
  const std::string note = format(
      "better, worse: significant at %g %% (paired bootstrap, %d resamples of recordings and "
      "windows) and\nrelevant; =: neither.",
      100.0 * options.confidence, options.resamples);
  TitledTable overview{"comparison_overview", "", note, std::move(table)};
  if (!comparisons.empty()) {
    const PairedComparison& c = comparisons.front();
    overview.title = "Compared with " + c.a + ", " + shapeText({c.keyframes, c.rate_hz});
    if (few > 0)
      overview.note += "\nfew: too few pairs whose windows do not overlap (fewer than " +
                       std::to_string(kMinPairs) + ").";
    if (c.interval.clusters == 1) overview.note += " One recording: it holds for this one alone.";
  }
  return overview;
}

std::string glossary() {
  return "Terms:\n"
         "  window       keyframes of one attempt to initialize, e.g. 10 at 4 Hz: 2.25 s\n"
         "  VI-BA        visual-inertial bundle adjustment, the same after every initializer\n"
         "  success      gravity off by less than 2 deg and velocity by less than 0.1 m/s, of all "
         "windows;\n"
         "               a refused window is a failure\n"
         "  false accept accepted as a start, but no success or outside 3.5 of its own standard "
         "deviations\n"
         "  RRE          relative rotation error: RMSE between consecutive keyframes, deg\n"
         "  RPE          relative pose error over a stated length\n"
         "  ATE          absolute trajectory error: RMSE of positions after SE(3) alignment, m\n"
         "  gravity, v   angle of gravity's direction; norm of the velocity error, in the body's "
         "frame\n"
         "  b_g, b_a     bias of gyroscope, rad/s, and accelerometer, m/s^2\n"
         "  NEES         squared error over predicted covariance, per degree of freedom: 1 where "
         "that is right\n"
         "  coverage     share of frames with a pose\n"
         "  causal       as known at the frame itself; smoothed: as known later; final: bundle "
         "adjusted\n"
         "The definitions: docs/evaluation.md.\n";
}

}  // namespace etalon
