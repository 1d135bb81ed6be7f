#include "etalon/report/benchmark_tables.h"

#include <algorithm>

#include "benchmark_side_tables.h"
#include "etalon/benchmark/windows.h"
#include "etalon/core/text.h"

namespace etalon {
namespace {

std::string cellKey(const std::string& initializer, const std::string& stage) {
  return initializer + "_" + stage;
}

const SummaryRow& rowOf(const std::vector<SummaryRow>& summary, const SummaryRow& key) {
  return *std::find_if(summary.begin(), summary.end(), [&](const SummaryRow& row) {
    return row.sequence == key.sequence && row.keyframes == key.keyframes &&
           row.rate_hz == key.rate_hz && row.initializer == key.initializer &&
           row.stage == key.stage && row.which == kAllWindows;
  });
}

/** How a table of the papers' layout is filled. */
struct Layout {
  int decimals = 0;
  double factor = 1.0;
  bool least_is_best = true;
  bool mark_best = true;
  std::vector<Table::Column> before, after;  ///< columns beside the initializers'
  std::vector<std::string> stages = {};      ///< empty: all
};

/** Makes a row for each sequence and one over all; `value` gives a cell from its summary, `more`
 * fills the columns beside. */
template <typename Value, typename More>
Table papersLayout(const BenchmarkRecord& record, const std::vector<SummaryRow>& summary,
                   const WindowShape& shape, const Layout& layout, Value value, More more) {
  std::vector<Table::Column> columns = {{"sequence", "sequence"}};
  columns.insert(columns.end(), layout.before.begin(), layout.before.end());
  const std::vector<std::string> initializers = initializersOf(record);
  const std::vector<std::string> stages = layout.stages.empty() ? stagesOf(record) : layout.stages;
  for (const std::string& stage : stages)
    for (const std::string& initializer : initializers)
      columns.push_back({cellKey(initializer, stage), initializer, true, layout.decimals,
                         layout.factor, false, groupOf(stage)});
  columns.insert(columns.end(), layout.after.begin(), layout.after.end());

  Table table(columns);
  std::vector<std::string> sequences = sequencesOf(record);
  sequences.emplace_back(kAllSequences);
  SummaryRow key;
  key.keyframes = shape.keyframes;
  key.rate_hz = shape.rate_hz;
  for (const std::string& sequence : sequences) {
    key.sequence = sequence;
    if (sequence == kAllSequences) table.addRule();
    table.addRow();
    table.setText("sequence", sequence);
    for (const std::string& stage : stages) {
      key.stage = stage;
      std::vector<std::string> cells;
      for (const std::string& initializer : initializers) {
        key.initializer = initializer;
        const SummaryRow& row = rowOf(summary, key);
        table.setNumber(cellKey(initializer, stage), value(row));
        // A method that answers only where it is easy is not the best.
        if (canBeBest(row)) cells.push_back(cellKey(initializer, stage));
        more(&table, row);
      }
      if (layout.mark_best) table.markBest(cells, layout.least_is_best);
    }
  }
  return table;
}

/** Fills the fields that programs read in a table of the papers' layout. */
TitledTable described(TitledTable table, const WindowShape& shape, const std::string& metric,
                      const std::string& statistic, bool marks_best) {
  table.metric = metric;
  table.statistic = statistic;
  table.keyframes = shape.keyframes;
  table.rate_hz = shape.rate_hz;
  table.marks_best = marks_best;
  return table;
}

void nothingMore(Table* /*table*/, const SummaryRow& /*row*/) {}

const BenchmarkSequence* sequenceOf(const BenchmarkRecord& record, const std::string& name) {
  for (const BenchmarkSequence& sequence : record.sequences)
    if (sequence.name == name) return &sequence;
  return nullptr;
}

/** A figure beside the numbers of windows that it is over. */
template <typename Value>
Table judgedLayout(const BenchmarkRecord& record, const std::vector<SummaryRow>& summary,
                   const WindowShape& shape, Layout layout, Value value) {
  layout.before = {{"windows", "windows", true, 0}, {"judged", "judged", true, 0}};
  return papersLayout(record, summary, shape, layout, value, [](Table* t, const SummaryRow& row) {
    t->setNumber("windows", row.count);
    t->setNumber("judged", row.judged);
  });
}

TitledTable successTable(const BenchmarkRecord& record, const std::vector<SummaryRow>& summary,
                         const WindowShape& shape) {
  Layout layout;
  layout.decimals = 1;
  layout.factor = 100.0;
  layout.least_is_best = false;
  Table table = judgedLayout(record, summary, shape, layout,
                             [](const SummaryRow& row) { return row.success_rate; });
  return described({"success" + shapeId(shape), "Success [%], " + shapeText(shape),
                    "Gravity off by less than 2 deg and velocity by less than 0.1 m/s, of all "
                    "windows whose ground truth allows to judge it; a refused window counts as a "
                    "failure.",
                    std::move(table), true, kSuccessRate},
                   shape, kSuccessRate, "rate", true);
}

/** The cost of the acceptance after VI-BA: the success if every estimate were accepted. */
TitledTable goodEstimatesTable(const BenchmarkRecord& record,
                               const std::vector<SummaryRow>& summary, const WindowShape& shape) {
  Layout layout;
  layout.decimals = 1;
  layout.factor = 100.0;
  layout.least_is_best = false;
  layout.stages = {kStageViBa};
  Table table = judgedLayout(record, summary, shape, layout,
                             [](const SummaryRow& row) { return row.good_estimate_rate; });
  return described({"good_estimates" + shapeId(shape),
                    "Good estimates, accepted or not [%], " + shapeText(shape),
                    "As success, but of all estimates of VI-BA, whether they were accepted as a "
                    "start or not: what is more here than there was refused without need.",
                    std::move(table), true},
                   shape, "good_estimates", "rate", true);
}

TitledTable refusalTable(const BenchmarkRecord& record, const std::vector<SummaryRow>& summary,
                         const WindowShape& shape) {
  Layout layout;
  layout.mark_best = false;
  layout.before = {{"windows", "windows", true, 0}};
  Table table = papersLayout(
      record, summary, shape, layout,
      [](const SummaryRow& row) { return static_cast<double>(row.count - row.accepted); },
      [](Table* t, const SummaryRow& row) { t->setNumber("windows", row.count); });
  return described({"refusals" + shapeId(shape), "Windows refused, " + shapeText(shape),
                    "Without VI-BA: the initializer gave no estimate. With VI-BA: there was none, "
                    "or it was not accepted as a start.",
                    std::move(table), true},
                   shape, "refusals", "count", false);
}

TitledTable falseAcceptTable(const BenchmarkRecord& record, const std::vector<SummaryRow>& summary,
                             const WindowShape& shape) {
  Layout layout;
  layout.mark_best = false;
  layout.stages = {kStageViBa};
  Table table = judgedLayout(record, summary, shape, layout,
                             [](const SummaryRow& row) -> double { return row.false_accepts; });
  return described(
      {"false_accepts" + shapeId(shape), "False accepts, " + shapeText(shape),
       "Accepted, but gravity is off by 2 deg or more, velocity by 0.1 m/s or more, or "
       "tilt, velocity or accelerometer bias by more than 3.5 standard deviations of "
       "the estimate's own covariance.",
       std::move(table), true},
      shape, "false_accepts", "count", false);
}

TitledTable windowLengthTable(const BenchmarkRecord& record, const std::vector<SummaryRow>& summary,
                              const WindowShape& shape) {
  Layout layout;
  layout.decimals = 2;
  layout.mark_best = false;
  layout.stages = {kStageViBa};
  Table table = judgedLayout(record, summary, shape, layout,
                             [](const SummaryRow& row) { return row.window_s.median; });
  return described(
      {"window_s" + shapeId(shape), "Length of accepted windows [s], median, " + shapeText(shape),
       "They grow from " + std::to_string(record.protocol.min_keyframes) +
           " keyframes; run times are those of all attempts.",
       std::move(table), true},
      shape, "window_s", "median", false);
}

TitledTable runtimeTable(const BenchmarkRecord& record, const std::vector<SummaryRow>& summary,
                         const WindowShape& shape) {
  Layout layout;
  layout.decimals = 2;
  Table table = papersLayout(
      record, summary, shape, layout, [](const SummaryRow& row) { return row.runtime_ms.median; },
      nothingMore);
  return described(
      {"runtime" + shapeId(shape), "Run time [ms], median, " + shapeText(shape),
       "Without VI-BA: the initializer alone, stereo odometry apart. With VI-BA: the VI-BA alone.",
       std::move(table), true},
      shape, "runtime_ms", "median", true);
}

/** Tilt and velocity; a recording's ground truth does not know the biases well enough for the IMU's
 * noise. */
constexpr size_t kPrintedNees = 2;

/** Whether the errors are as large as the estimates' covariances say. @param index in neesMetrics()
 */
TitledTable neesTable(const BenchmarkRecord& record, const std::vector<SummaryRow>& summary,
                      const WindowShape& shape, size_t index) {
  const WindowMetric metric = neesMetrics()[index];
  Layout layout;
  layout.decimals = metric.decimals;
  layout.mark_best = false;
  Table table = papersLayout(
      record, summary, shape, layout,
      [index](const SummaryRow& row) { return row.nees[index].mean; }, nothingMore);
  return described(
      {metric.key + "_mean" + shapeId(shape), metric.title + ", mean, " + shapeText(shape),
       "Squared error over the covariance that the estimate claims, per degree of freedom: 1 where "
       "errors are as large as predicted, 4 where they are twice as large. Over the windows with a "
       "covariance; the ground truth's own error counts as the estimate's.",
       std::move(table), false, ""},
      shape, metric.key, "mean", false);
}

}  // namespace

TitledTable errorTable(const BenchmarkRecord& record, const std::vector<SummaryRow>& summary,
                       WindowShape shape, const WindowMetric& metric, SummaryStatistic statistic) {
  const std::vector<WindowMetric> metrics = windowMetrics();
  const size_t index = std::find_if(metrics.begin(), metrics.end(),
                                    [&](const WindowMetric& m) { return m.key == metric.key; }) -
                       metrics.begin();
  Layout layout;
  layout.decimals = metric.decimals;
  layout.factor = metric.factor;
  std::string note = "Over the windows with an estimate.";
  const bool rotation = metric.key == "rre_deg", gravity = metric.key == "gravity_deg";
  const bool gyro_bias = metric.key == "gyro_bias_rps";
  if (rotation || gravity || gyro_bias) {
    layout.after = {{gravity ? "world_tilt_deg" : "lower_bound", gravity ? "tilt" : "lower bound",
                     true, metric.decimals, 1.0, false, rotation ? "gyro alone" : "ground truth"}};
    note += boundNote(record, metric.key);
  }
  Table table = papersLayout(
      record, summary, shape, layout,
      [&](const SummaryRow& row) { return valueOf(row.errors[index], statistic); },
      [&](Table* t, const SummaryRow& row) {
        const auto boundOf = [&](double WindowTruthCheck::*bound) {
          return valueOf(truthCheck(record, shape, row.sequence, bound), statistic);
        };
        const BenchmarkSequence* sequence = sequenceOf(record, row.sequence);
        if (rotation)
          t->setNumber("lower_bound", boundOf(&WindowTruthCheck::rre_deg));
        else if (gyro_bias)
          t->setNumber("lower_bound", boundOf(&WindowTruthCheck::gyro_bias_rps));
        else if (gravity && sequence)
          t->setNumber("world_tilt_deg", sequence->ground_truth_check.world_tilt_deg);
      });
  const std::string suffix = statistic == SummaryStatistic::kP90 ? "p90" : nameOf(statistic);
  const bool papers = rotation || metric.key == "ate_m";
  const bool median_is_headline = papers || gravity || metric.key == "gravity_corrected_deg" ||
                                  metric.key == "velocity_mps" || metric.key == "gyro_bias_rps" ||
                                  metric.key == "accel_bias_mps2";
  return described(
      {metric.key + "_" + suffix + shapeId(shape),
       metric.title + ", " + nameOf(statistic) + ", " + shapeText(shape), note, std::move(table),
       (papers && statistic == SummaryStatistic::kMean) ||
           (median_is_headline && statistic == SummaryStatistic::kMedian),
       metric.key},
      shape, metric.key, suffix, true);
}

std::vector<TitledTable> benchmarkTables(const BenchmarkRecord& record) {
  const std::vector<SummaryRow> summary = summarize(record);
  const std::vector<std::string> stages = stagesOf(record);
  const bool vi_ba = std::find(stages.begin(), stages.end(), kStageViBa) != stages.end();
  std::vector<TitledTable> tables;
  for (const WindowShape& shape : shapesOf(record)) {
    const size_t first = tables.size();
    tables.push_back(successTable(record, summary, shape));
    if (vi_ba) tables.push_back(goodEstimatesTable(record, summary, shape));
    tables.push_back(refusalTable(record, summary, shape));
    if (vi_ba) tables.push_back(falseAcceptTable(record, summary, shape));
    if (vi_ba && record.protocol.min_keyframes > 0)
      tables.push_back(windowLengthTable(record, summary, shape));
    for (const WindowMetric& metric : windowMetrics())
      for (const SummaryStatistic statistic :
           {SummaryStatistic::kMean, SummaryStatistic::kMedian, SummaryStatistic::kP90})
        tables.push_back(errorTable(record, summary, shape, metric, statistic));
    for (size_t m = 0; m < kPrintedNees; ++m)
      tables.push_back(neesTable(record, summary, shape, m));
    tables.push_back(runtimeTable(record, summary, shape));
    tables.push_back(runtimePartsTable(record, shape));
    if (std::optional<TitledTable> noise = noiseTable(record, shape))
      tables.push_back(std::move(*noise));
    const std::vector<std::string> absent = tooShort(record, shape);
    for (size_t i = first; i < tables.size() && !absent.empty(); ++i)
      tables[i].note += " Not in the table: " + joined(absent, "; ") + ".";
  }
  tables.push_back(groundTruthTable(record));
  return tables;
}

std::string noteOf(const TitledTable& table, const std::string& mark) {
  if (!table.marks_best) return table.note;
  const bool new_line = table.note.empty() || table.note.back() == '\n';
  return table.note + (new_line ? "Best " : " Best ") + mark +
         ", of the initializers with an estimate in three quarters of the windows.";
}

std::string toString(const TitledTable& table, TableFormat format, const TextStyle& style) {
  Table titled = table.table;
  if (format == TableFormat::kText) {
    const bool bold = style.mark == CellMark::kTerminalBold;
    titled.setCaption(bold ? "\033[1m" + table.title + "\033[0m" : table.title);
    const std::string text = titled.toString(format, style);
    if (style.mark == CellMark::kNone) return text + (table.note.empty() ? "" : table.note + "\n");
    const std::string note = noteOf(table, bold ? "in bold" : "marked *");
    return text + (note.empty() ? "" : note + "\n");
  }
  const std::string note = noteOf(table);
  if (format == TableFormat::kMarkdown)
    titled.setCaption("**" + table.title + "**" + (note.empty() ? "" : "\n\n" + note));
  else
    titled.setCaption(table.title + (note.empty() ? "" : ". " + note));
  return titled.toString(format);
}

}  // namespace etalon
