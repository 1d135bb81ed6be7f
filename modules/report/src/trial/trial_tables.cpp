#include "etalon/report/trial_tables.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <sstream>

#include "etalon/core/text.h"
#include "report_page.h"
#include "trial/trial_differences.h"

namespace etalon {
namespace {

/** Beyond so many variants the table of faults has no column for each. */
constexpr size_t kMostColumns = 4;
/** Longest line of a page. */
constexpr size_t kPageWidth = 100;

/** The text without its middle if it is longer than `longest` bytes. */
std::string shortened(std::string text, size_t longest) {
  if (text.size() <= longest) return text;
  const auto inCharacter = [&](size_t at) { return (text[at] & 0xc0) == 0x80; };  // of UTF-8
  size_t begin = longest / 2, end = text.size() - (longest - 1 - begin);
  while (begin > 0 && inCharacter(begin)) --begin;
  while (end < text.size() && inCharacter(end)) ++end;
  return text.replace(begin, end - begin, "~");
}

/** The variants of a trial and what they are called in its tables. */
struct Variants {
  /** @param longest bytes of a label */
  explicit Variants(const TrialRecord& record, size_t longest = std::string::npos)
      : all(variantsOf(record)) {
    for (const TrialVariant& variant : all)
      labels.push_back(shortened(labelOf(variant, record), longest));
  }

  std::vector<TrialVariant> all;
  std::vector<std::string> labels;  ///< of each
};

size_t longestLine(const std::string& text) {
  std::istringstream in(text);
  size_t longest = 0;
  for (std::string line; std::getline(in, line);) longest = std::max(longest, displayWidth(line));
  return longest;
}

/** "7/8"; "-" of none. */
std::string ofAll(int part, int all) {
  return all == 0 ? "-" : std::to_string(part) + "/" + std::to_string(all);
}

WhichRuns runsOf(const TrialVariant& variant) {
  return [variant](const TrialRun& run) { return run.variant == variant; };
}

TitledTable variantTable(const TrialRecord& record, const Variants& variants) {
  Table table({{"variant", "what flew"},
               {"survived", "survived"},
               {"silent", "silent", true, 0},
               {"coverage", "[%]", true, 1, 100.0, false, "cover"},
               {"started_s", "[s]", true, 2, 1.0, false, "start"},
               {"causal_ate_m", "causal", true, 1, 1e3, false, "ATE [mm]"},
               {"smoothed_ate_m", "smoothed", true, 1, 1e3, false, "ATE [mm]"},
               {"causal_rpe_m", "causal", true, 1, 1e3, false, "RPE 1 s [mm]"},
               {"smoothed_rpe_m", "smoothed", true, 1, 1e3, false, "RPE 1 s [mm]"},
               {"error_over_predicted", "err/pred", true, 1},
               {"frame_ms", "[ms]", true, 1}});
  for (size_t v = 0; v < variants.all.size(); ++v) {
    const TrialVariant& variant = variants.all[v];
    const TrialSummary all = summaryOf(record, runsOf(variant));
    const TrialSummary plain = summaryOf(record, [&](const TrialRun& run) {
      return run.variant == variant && run.fault == kNoFault;
    });
    table.addRow();
    table.setText("variant", variants.labels[v]);
    table.setText("survived", ofAll(all.survived, all.runs));
    table.setNumber("silent", all.silent);
    table.setNumber("coverage", all.coverage);
    table.setNumber("started_s", plain.started_s.median);
    table.setNumber("causal_ate_m", plain.causal_ate_m.median);
    table.setNumber("smoothed_ate_m", plain.smoothed_ate_m.median);
    table.setNumber("causal_rpe_m", plain.causal_rpe_m.median);
    table.setNumber("smoothed_rpe_m", plain.smoothed_rpe_m.median);
    table.setNumber("error_over_predicted", plain.error_over_predicted.median);
    table.setNumber("frame_ms", all.frame_ms.median);
  }
  size_t starts = 0, recordings = 0;
  for (const BenchmarkSequence& sequence : record.sequences) {
    const size_t count = sequence.error.empty() ? startsOf(record.protocol, sequence).size() : 0;
    starts += count;
    recordings += count > 0 ? 1 : 0;
  }
  const std::string length =
      record.protocol.seconds > 0.0 ? format(" of %g s", record.protocol.seconds) : " to the end";
  TitledTable titled{
      "variants",
      counted(recordings, "recording") + ", " + counted(starts, "start") + length + ", " +
          counted(record.faults.size() - 1, "fault"),
      format("survived: poses since the fault, ATE <= %g m, not lost; silent: off by more than 5 "
             "predicted\nstandard deviations and 0.1 m without an event; cover: poses of frames; "
             "err/pred: position's error\nover the predicted one; errors: medians without a fault",
             record.protocol.ate_limit_m),
      table};
  titled.headline = true;
  return titled;
}

/** What a fault does, for choosing the rows that matter. */
struct FaultRow {
  std::string fault;
  TrialSummary summary;

  /** The worse, the greater. */
  std::pair<int, double> badness() const {
    return {summary.runs - summary.survived,
            std::isfinite(summary.largest_added_ate_m) ? summary.largest_added_ate_m : -1.0};
  }
};

/** The rows in the record's order; of more than `most` the worst ones, and kNoFault. */
std::vector<FaultRow> faultRows(const TrialRecord& record, size_t most) {
  std::vector<FaultRow> rows;
  for (const NamedText& fault : record.faults)
    rows.push_back({fault.name, summaryOf(record, [&](const TrialRun& run) {
                      return run.fault == fault.name;
                    })});
  while (rows.size() > std::max<size_t>(most, 2))
    rows.erase(std::min_element(
        rows.begin() + 1, rows.end(),
        [](const FaultRow& a, const FaultRow& b) { return a.badness() < b.badness(); }));
  return rows;
}

TitledTable faultTable(const TrialRecord& record, const Variants& variants, size_t most_rows) {
  const bool by_variant = variants.all.size() > 1 && variants.all.size() <= kMostColumns;
  std::vector<Table::Column> columns = {{"fault", "fault"}};
  if (by_variant)
    for (size_t i = 0; i < variants.all.size(); ++i)
      columns.push_back(
          {"survived_" + std::to_string(i), variants.labels[i], false, 0, 1.0, false, "survived"});
  else
    columns.push_back({"survived", "survived"});
  for (const Table::Column& column :
       {Table::Column{"reported", "reported"}, Table::Column{"silent", "silent", true, 0},
        Table::Column{"ate_m", "median", true, 1, 1e3, false, "ATE [mm]"},
        Table::Column{"added_m", "added", true, 1, 1e3, false, "ATE [mm]"},
        Table::Column{"largest_added_m", "largest", true, 1, 1e3, false, "ATE [mm]"}})
    columns.push_back(column);
  Table table(columns);
  const std::vector<FaultRow> rows = faultRows(record, most_rows);
  for (const FaultRow& row : rows) {
    const TrialSummary& all = row.summary;
    table.addRow();
    table.setText("fault", row.fault);
    if (!by_variant) table.setText("survived", ofAll(all.survived, all.runs));
    for (size_t i = 0; by_variant && i < variants.all.size(); ++i) {
      const TrialSummary one = summaryOf(record, [&](const TrialRun& run) {
        return run.fault == row.fault && run.variant == variants.all[i];
      });
      table.setText("survived_" + std::to_string(i), ofAll(one.survived, one.runs));
    }
    if (row.fault != kNoFault) table.setText("reported", ofAll(all.reported, all.faulty));
    table.setNumber("silent", all.silent);
    table.setNumber("ate_m", all.causal_ate_m.median);
    table.setNumber("added_m", all.added_ate_m.median);
    table.setNumber("largest_added_m", all.largest_added_ate_m);
  }
  std::string note = "reported: an event since the fault; silent: wrong without one";
  if (rows.size() < record.faults.size())
    note += "; " + counted(record.faults.size() - rows.size(), "milder fault") + " in report.html";
  TitledTable titled{"faults", "What each fault does to the causal trajectory", note, table};
  titled.headline = record.faults.size() > 1;
  return titled;
}

std::string keyOf(double after_s, const char* figure) {
  return (after_s > 0.0 ? format("after_%gs_", after_s) : std::string("at_end_")) + figure;
}

TitledTable afterStartTable(const TrialRecord& record, const Variants& variants) {
  std::vector<Table::Column> columns = {{"variant", "what flew"}};
  for (const double after_s : timesAfterStart()) {
    const std::string group = after_s > 0.0 ? format("after %g s", after_s) : "at the end";
    columns.push_back({keyOf(after_s, "ate_m"), "ATE", true, 1, 1e3, false, group});
    columns.push_back({keyOf(after_s, "velocity_mps"), "v", true, 1, 1e3, false, group});
    columns.push_back({keyOf(after_s, "tilt_deg"), "tilt", true, 2, 1.0, false, group});
  }
  Table table(columns);
  for (size_t v = 0; v < variants.all.size(); ++v) {
    const TrialVariant& variant = variants.all[v];
    table.addRow();
    table.setText("variant", variants.labels[v]);
    for (const double after_s : timesAfterStart()) {
      const auto median = [&](double ErrorsAfterStart::*figure) {
        return afterStart(record, variant, after_s, figure).median;
      };
      table.setNumber(keyOf(after_s, "ate_m"), median(&ErrorsAfterStart::ate_m));
      table.setNumber(keyOf(after_s, "velocity_mps"), median(&ErrorsAfterStart::velocity_mps));
      table.setNumber(keyOf(after_s, "tilt_deg"), median(&ErrorsAfterStart::tilt_deg));
    }
  }
  TitledTable titled{
      "after_start", "What the start is worth: errors since it, without a fault (medians)",
      "ATE [mm] aligned in yaw and position, velocity [mm/s], roll and pitch [deg]: RMS.", table};
  titled.headline = variants.all.size() > 1;
  return titled;
}

TitledTable recordingTable(const TrialRecord& record, const Variants& variants) {
  Table table({{"recording", "recording"},
               {"variant", "what flew"},
               {"survived", "survived"},
               {"coverage", "cover [%]", true, 1, 100.0},
               {"causal_ate_m", "causal", true, 1, 1e3, false, "ATE [mm]"},
               {"smoothed_ate_m", "smoothed", true, 1, 1e3, false, "ATE [mm]"},
               {"added_m", "added by faults", true, 1, 1e3, false, "ATE [mm]"},
               {"largest_added_m", "largest", true, 1, 1e3, false, "ATE [mm]"},
               {"error_over_predicted", "err/pred", true, 1}});
  for (const BenchmarkSequence& sequence : record.sequences)
    for (size_t v = 0; v < variants.all.size(); ++v) {
      const TrialVariant& variant = variants.all[v];
      const auto which = [&](const TrialRun& run) {
        return run.recording == sequence.name && run.variant == variant;
      };
      const TrialSummary all = summaryOf(record, which);
      if (all.runs + all.not_judged == 0) continue;
      const TrialSummary plain = summaryOf(
          record, [&](const TrialRun& run) { return which(run) && run.fault == kNoFault; });
      table.addRow();
      table.setText("recording", sequence.name);
      table.setText("variant", variants.labels[v]);
      table.setText("survived", ofAll(all.survived, all.runs));
      table.setNumber("coverage", all.coverage);
      table.setNumber("causal_ate_m", plain.causal_ate_m.median);
      table.setNumber("smoothed_ate_m", plain.smoothed_ate_m.median);
      table.setNumber("added_m", all.added_ate_m.median);
      table.setNumber("largest_added_m", all.largest_added_ate_m);
      table.setNumber("error_over_predicted", plain.error_over_predicted.median);
    }
  return {"recordings", "By recording", "ATE: medians of the runs without a fault.", table};
}

TitledTable failureTable(const TrialRecord& record) {
  Table table({{"recording", "recording"},
               {"from_s", "from [s]", true, 1},
               {"variant", "what flew"},
               {"fault", "fault"},
               {"ate_m", "ATE [mm]", true, 1, 1e3},
               {"reason", "why it failed"},
               {"event", "what was reported"}});
  for (const TrialRun& run : record.results) {
    if (run.survived() || !run.judged()) continue;
    table.addRow();
    table.setText("recording", run.recording);
    table.setNumber("from_s", run.from_s);
    table.setText("variant", labelOf(run.variant, record));
    table.setText("fault", run.fault);
    table.setNumber("ate_m", run.causal.ate_m);
    table.setText("reason", run.reason);
    table.setText("event", run.event);
  }
  return {"failures", "Failures", table.rowCount() > 0 ? "" : "No run that was judged failed.",
          table};
}

}  // namespace

std::vector<TitledTable> trialTables(const TrialRecord& record) {
  const Variants variants(record);
  std::vector<TitledTable> tables = {
      variantTable(record, variants), faultTable(record, variants, record.faults.size()),
      afterStartTable(record, variants), recordingTable(record, variants)};
  if (variants.all.size() > 1) tables.push_back(differenceTable(record));
  tables.push_back(failureTable(record));
  return tables;
}

std::string trialPage(const TrialRecord& record, const TextStyle& style, size_t lines) {
  constexpr size_t kTableFrame = 5, kMostReasons = 4, kShortestLabel = 6;
  size_t longest_label = kShortestLabel;
  for (const std::string& label : Variants(record).labels)
    longest_label = std::max(longest_label, label.size());
  // The labels lose as many characters as the table needs.
  const auto text = [&](const std::function<TitledTable(const Variants&)>& tableWith) {
    for (size_t longest = longest_label;; --longest) {
      const TitledTable table = tableWith(Variants(record, longest));
      if (!table.headline) return std::string();
      if (longest == kShortestLabel ||
          longestLine(table.table.toString(TableFormat::kText)) <= kPageWidth)
        return toString(table, TableFormat::kText, {style.mark, 0});
    }
  };
  const auto countLines = [](const std::string& t) {
    return static_cast<size_t>(std::count(t.begin(), t.end(), '\n'));
  };
  const std::vector<FailureKind> failures = failuresOf(record);
  std::string page = text([&](const Variants& all) { return variantTable(record, all); });
  const std::string after = text([&](const Variants& all) { return afterStartTable(record, all); });
  const size_t others =
      countLines(page) + countLines(after) + kTableFrame + std::min(failures.size(), kMostReasons);
  const size_t most = lines > others ? lines - others : 0;
  page += text([&](const Variants& all) { return faultTable(record, all, most); }) + after;
  size_t used = countLines(page), left = 0;
  for (size_t i = 0; i < failures.size(); ++i) {
    const std::vector<size_t>& runs = failures[i].runs;
    // The last line counts what is left.
    if (left > 0 || used + (i + 1 < failures.size() ? 1 : 0) >= lines) {
      left += runs.size();
      continue;
    }
    const TrialRun& run = record.results[runs.front()];
    std::string line = (runs.size() > 1 ? format("%zu failed, e.g. ", runs.size()) : "failed: ") +
                       run.recording + format(" from %g s, ", run.from_s) +
                       labelOf(run.variant, record) + ", " + run.fault + ": " + failures[i].reason;
    if (displayWidth(line) > kPageWidth) line = line.substr(0, kPageWidth - 3) + "...";
    page += line + "\n";
    ++used;
  }
  if (left > 0) page += counted(left, "other failure") + ": report.html, runs.csv\n";
  return page;
}

}  // namespace etalon
