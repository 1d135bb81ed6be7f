#include "etalon/evaluation/benchmark_tables.h"

#include <algorithm>

#include "benchmark_side_tables.h"

namespace etalon {
namespace {

constexpr const char* kWithout = "without VI-BA";
constexpr const char* kWith = "with VI-BA";

std::string groupOf(const std::string& stage) { return stage == kStageInit ? kWithout : kWith; }

std::string cellKey(const std::string& initializer, const std::string& stage) {
  return initializer + "_" + stage;
}

const SummaryRow& rowOf(const std::vector<SummaryRow>& summary, const SummaryRow& key) {
  return *std::find_if(summary.begin(), summary.end(), [&](const SummaryRow& row) {
    return row.sequence == key.sequence && row.keyframes == key.keyframes &&
           row.rate_hz == key.rate_hz && row.initializer == key.initializer &&
           row.stage == key.stage && row.slots == kAllSlots;
  });
}

/** An initializer must have an estimate in so many of the slots for its figures to count as best.
 */
constexpr double kShareForBest = 0.75;

/** How a table of the papers' layout is filled. */
struct Layout {
  int decimals = 0;
  double factor = 1.0;
  bool least_is_best = true;
  bool mark_best = true;
  std::vector<Table::Column> before, after;  ///< columns beside the initializers'
};

/** A row a sequence and one over all; `value` gives a cell from its summary, `more` fills the
 * columns beside. */
template <typename Value, typename More>
Table papersLayout(const BenchmarkRecord& record, const std::vector<SummaryRow>& summary,
                   const Window& window, const Layout& layout, Value value, More more) {
  std::vector<Table::Column> columns = {{"sequence", "sequence"}};
  columns.insert(columns.end(), layout.before.begin(), layout.before.end());
  const std::vector<std::string> initializers = initializersOf(record);
  for (const std::string& stage : stagesOf(record))
    for (const std::string& initializer : initializers)
      columns.push_back({cellKey(initializer, stage), initializer, true, layout.decimals,
                         layout.factor, false, groupOf(stage)});
  columns.insert(columns.end(), layout.after.begin(), layout.after.end());

  Table table(columns);
  std::vector<std::string> sequences = sequencesOf(record);
  sequences.emplace_back(kAllSequences);
  SummaryRow key;
  key.keyframes = window.first;
  key.rate_hz = window.second;
  for (const std::string& sequence : sequences) {
    key.sequence = sequence;
    if (sequence == kAllSequences) table.addRule();
    table.addRow();
    table.setText("sequence", sequence);
    for (const std::string& stage : stagesOf(record)) {
      key.stage = stage;
      std::vector<std::string> cells;
      for (const std::string& initializer : initializers) {
        key.initializer = initializer;
        const SummaryRow& row = rowOf(summary, key);
        table.setNumber(cellKey(initializer, stage), value(row));
        // Who answers only where it is easy is not the best.
        if (row.estimates >= kShareForBest * row.count)
          cells.push_back(cellKey(initializer, stage));
        more(&table, row);
      }
      if (layout.mark_best) table.markBest(cells, layout.least_is_best);
    }
  }
  return table;
}

void nothingMore(Table* /*table*/, const SummaryRow& /*row*/) {}

const BenchmarkSequence* sequenceOf(const BenchmarkRecord& record, const std::string& name) {
  for (const BenchmarkSequence& sequence : record.sequences)
    if (sequence.name == name) return &sequence;
  return nullptr;
}

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

TitledTable successTable(const BenchmarkRecord& record, const std::vector<SummaryRow>& summary,
                         const Window& window) {
  Layout layout;
  layout.decimals = 1;
  layout.factor = 100.0;
  layout.least_is_best = false;
  layout.before = {{"slots", "slots", true, 0}, {"judged", "judged", true, 0}};
  Table table = papersLayout(
      record, summary, window, layout, [](const SummaryRow& row) { return row.success_rate; },
      [](Table* t, const SummaryRow& row) {
        t->setNumber("slots", row.count);
        t->setNumber("judged", row.judged);
      });
  return {"success" + windowId(window),
          "Success [%], " + windowText(window),
          "Gravity off by less than 2 deg and velocity by less than 0.1 m/s, of all slots whose "
          "ground truth allows to judge it; a refused slot counts as a failure.",
          std::move(table),
          true,
          kSuccessRate};
}

TitledTable refusalTable(const BenchmarkRecord& record, const std::vector<SummaryRow>& summary,
                         const Window& window) {
  Layout layout;
  layout.mark_best = false;
  layout.before = {{"slots", "slots", true, 0}};
  Table table = papersLayout(
      record, summary, window, layout,
      [](const SummaryRow& row) { return static_cast<double>(row.count - row.accepted); },
      [](Table* t, const SummaryRow& row) { t->setNumber("slots", row.count); });
  return {"refusals" + windowId(window), "Slots refused, " + windowText(window),
          "Without VI-BA: the initializer gave no estimate. With VI-BA: there was none, or it was "
          "not accepted as a start.",
          std::move(table), true};
}

TitledTable runtimeTable(const BenchmarkRecord& record, const std::vector<SummaryRow>& summary,
                         const Window& window) {
  Layout layout;
  layout.decimals = 2;
  Table table = papersLayout(
      record, summary, window, layout, [](const SummaryRow& row) { return row.runtime_ms.median; },
      nothingMore);
  return {"runtime" + windowId(window), "Run time [ms], median, " + windowText(window),
          "Without VI-BA: the initializer alone, step 1 apart. With VI-BA: the VI-BA alone.",
          std::move(table), true};
}

}  // namespace

TitledTable errorTable(const BenchmarkRecord& record, const std::vector<SummaryRow>& summary,
                       std::pair<int, double> window, const SegmentMetric& metric,
                       SummaryStatistic statistic) {
  const std::vector<SegmentMetric> metrics = segmentMetrics();
  const auto index = static_cast<size_t>(
      std::find_if(metrics.begin(), metrics.end(),
                   [&](const SegmentMetric& m) { return m.key == metric.key; }) -
      metrics.begin());
  Layout layout;
  layout.decimals = metric.decimals;
  layout.factor = metric.factor;
  std::string note =
      "Over the slots with an estimate; best in bold, of those with an estimate in three quarters "
      "of "
      "the slots.";
  const bool rotation = metric.key == "rre_deg", gravity = metric.key == "gravity_deg";
  if (rotation || gravity) {
    layout.after = {{"floor", rotation ? "at best" : "tilt", true, metric.decimals, 1.0, false,
                     rotation ? "gyro alone" : "ground truth"}};
    note += rotation ? " Gyro alone, at best: the least that integrating the gyro can have, with "
                       "the bias that fits the window's ground truth best, over all slots; "
                       "rotations that vision has a part in may be better."
                     : " Tilt: of the ground truth's world against gravity.";
  }
  Table table = papersLayout(
      record, summary, window, layout,
      [&](const SummaryRow& row) { return valueOf(row.errors[index], statistic); },
      [&](Table* t, const SummaryRow& row) {
        const BenchmarkSequence* sequence = sequenceOf(record, row.sequence);
        if (rotation)
          t->setNumber("floor", valueOf(gyroFloor(record, window, row.sequence), statistic));
        else if (gravity && sequence)
          t->setNumber("floor", sequence->floor.world_tilt_deg);
      });
  const std::string suffix = statistic == SummaryStatistic::kP90 ? "p90" : nameOf(statistic);
  const bool papers = rotation || metric.key == "ate_m";
  return {metric.key + "_" + suffix + windowId(window),
          metric.title + ", " + nameOf(statistic) + ", " + windowText(window),
          note,
          std::move(table),
          statistic != SummaryStatistic::kP90 &&
              (papers || (statistic == SummaryStatistic::kMedian &&
                          (gravity || metric.key == "velocity_mps"))),
          metric.key};
}

std::vector<TitledTable> benchmarkTables(const BenchmarkRecord& record) {
  const std::vector<SummaryRow> summary = summarize(record);
  std::vector<TitledTable> tables;
  for (const Window& window : windowsOf(record)) {
    tables.push_back(successTable(record, summary, window));
    tables.push_back(refusalTable(record, summary, window));
    for (const SegmentMetric& metric : segmentMetrics())
      for (const SummaryStatistic statistic :
           {SummaryStatistic::kMean, SummaryStatistic::kMedian, SummaryStatistic::kP90})
        tables.push_back(errorTable(record, summary, window, metric, statistic));
    tables.push_back(runtimeTable(record, summary, window));
    tables.push_back(runtimePartsTable(record, window));
    if (std::optional<TitledTable> noise = noiseTable(record, window))
      tables.push_back(std::move(*noise));
  }
  tables.push_back(floorTable(record));
  return tables;
}

std::string toString(const TitledTable& table, TableFormat format, bool terminal_bold) {
  Table titled = table.table;
  if (format == TableFormat::kText)
    titled.setCaption(terminal_bold ? "\033[1m" + table.title + "\033[0m" : table.title);
  else if (format == TableFormat::kMarkdown)
    titled.setCaption("**" + table.title + "**" + (table.note.empty() ? "" : "\n\n" + table.note));
  else
    titled.setCaption(table.title + (table.note.empty() ? "" : ". " + table.note));
  const std::string text = titled.toString(format, terminal_bold);
  return format == TableFormat::kText && !table.note.empty() ? text + table.note + "\n" : text;
}

}  // namespace etalon
