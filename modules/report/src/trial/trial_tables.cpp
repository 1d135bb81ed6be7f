#include "etalon/report/trial_tables.h"

#include <algorithm>
#include <cmath>

#include "etalon/core/text.h"

namespace etalon {
namespace {

/** Beyond so many variants the table of faults has no column for each. */
constexpr size_t kMostColumns = 4;

std::string ofAll(int part, int all) { return std::to_string(part) + "/" + std::to_string(all); }

WhichRuns runsOf(const TrialVariant& variant) {
  return [variant](const TrialRun& run) { return run.variant == variant; };
}

TitledTable variantTable(const TrialRecord& record, const std::vector<TrialVariant>& variants) {
  Table table({{"variant", "what flew"},
               {"survived", "survived"},
               {"silent", "silent", true, 0},
               {"coverage", "cover [%]", true, 1, 100.0},
               {"started_s", "start [s]", true, 2},
               {"causal_ate_m", "causal", true, 1, 1e3, false, "ATE [mm]"},
               {"final_ate_m", "final", true, 1, 1e3, false, "ATE [mm]"},
               {"causal_rpe_m", "causal", true, 1, 1e3, false, "RPE 1 s [mm]"},
               {"final_rpe_m", "final", true, 1, 1e3, false, "RPE 1 s [mm]"},
               {"error_over_predicted", "err/pred", true, 1},
               {"frame_ms", "[ms]", true, 1}});
  for (const TrialVariant& variant : variants) {
    const TrialSummary all = summaryOf(record, runsOf(variant));
    const TrialSummary plain = summaryOf(record, [&](const TrialRun& run) {
      return run.variant == variant && run.fault == kNoFault;
    });
    table.addRow();
    table.setText("variant", labelOf(variant, record));
    table.setText("survived", ofAll(all.survived, all.runs));
    table.setNumber("silent", all.silent);
    table.setNumber("coverage", all.coverage);
    table.setNumber("started_s", plain.started_s.median);
    table.setNumber("causal_ate_m", plain.causal_ate_m.median);
    table.setNumber("final_ate_m", plain.final_ate_m.median);
    table.setNumber("causal_rpe_m", plain.causal_rpe_m.median);
    table.setNumber("final_rpe_m", plain.final_rpe_m.median);
    table.setNumber("error_over_predicted", plain.error_over_predicted.median);
    table.setNumber("frame_ms", all.frame_ms.median);
  }
  size_t starts = 0, recordings = 0;
  for (const BenchmarkSequence& sequence : record.sequences) {
    const size_t count = sequence.error.empty() ? startsOf(record.protocol, sequence).size() : 0;
    starts += count;
    recordings += count > 0 ? 1 : 0;
  }
  TitledTable titled{
      "variants",
      format("%zu recordings, %zu starts, %s, %zu faults; survived: located since "
             "the fault, ATE <= %g m, not lost",
             recordings, starts,
             record.protocol.seconds > 0.0 ? format("%g s each", record.protocol.seconds).c_str()
                                           : "to the end",
             record.faults.size() - 1, record.protocol.ate_limit_m),
      "Errors, ratios and start: medians of the runs without a fault.", table};
  titled.headline = true;
  return titled;
}

TitledTable faultTable(const TrialRecord& record, const std::vector<TrialVariant>& variants) {
  const bool by_variant = variants.size() > 1 && variants.size() <= kMostColumns;
  std::vector<Table::Column> columns = {{"fault", "fault"}};
  if (by_variant)
    for (size_t i = 0; i < variants.size(); ++i)
      columns.push_back({"survived_" + std::to_string(i), labelOf(variants[i], record), false, 0,
                         1.0, false, "survived"});
  else
    columns.push_back({"survived", "survived"});
  for (const Table::Column& column :
       {Table::Column{"said", "said"}, Table::Column{"silent", "silent", true, 0},
        Table::Column{"ate_m", "median", true, 1, 1e3, false, "ATE [mm]"},
        Table::Column{"added_m", "added", true, 1, 1e3, false, "ATE [mm]"},
        Table::Column{"largest_added_m", "largest", true, 1, 1e3, false, "ATE [mm]"}})
    columns.push_back(column);
  Table table(columns);
  for (const NamedText& fault : record.faults) {
    const TrialSummary all =
        summaryOf(record, [&](const TrialRun& run) { return run.fault == fault.name; });
    table.addRow();
    table.setText("fault", fault.name);
    if (!by_variant) table.setText("survived", ofAll(all.survived, all.runs));
    for (size_t i = 0; by_variant && i < variants.size(); ++i) {
      const TrialSummary one = summaryOf(record, [&](const TrialRun& run) {
        return run.fault == fault.name && run.variant == variants[i];
      });
      table.setText("survived_" + std::to_string(i), ofAll(one.survived, one.runs));
    }
    if (fault.name != kNoFault) table.setText("said", ofAll(all.said, all.faulty));
    table.setNumber("silent", all.silent);
    table.setNumber("ate_m", all.causal_ate_m.median);
    table.setNumber("added_m", all.added_ate_m.median);
    table.setNumber("largest_added_m", all.largest_added_ate_m);
  }
  TitledTable titled{"faults", "What each fault does to the causal trajectory",
                     "said: an event since the fault; silent: wrong without one.", table};
  titled.headline = record.faults.size() > 1;
  return titled;
}

std::string keyOf(double after_s, const char* figure) {
  return (after_s > 0.0 ? format("after_%gs_", after_s) : std::string("at_end_")) + figure;
}

TitledTable afterStartTable(const TrialRecord& record, const std::vector<TrialVariant>& variants) {
  std::vector<Table::Column> columns = {{"variant", "what flew"}};
  for (const double after_s : timesAfterStart()) {
    const std::string group = after_s > 0.0 ? format("after %g s", after_s) : "at the end";
    columns.push_back({keyOf(after_s, "ate_m"), "ATE", true, 1, 1e3, false, group});
    columns.push_back({keyOf(after_s, "velocity_mps"), "v", true, 1, 1e3, false, group});
    columns.push_back({keyOf(after_s, "tilt_deg"), "tilt", true, 2, 1.0, false, group});
  }
  Table table(columns);
  for (const TrialVariant& variant : variants) {
    table.addRow();
    table.setText("variant", labelOf(variant, record));
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
  titled.headline = true;
  return titled;
}

TitledTable recordingTable(const TrialRecord& record, const std::vector<TrialVariant>& variants) {
  Table table({{"recording", "recording"},
               {"variant", "what flew"},
               {"survived", "survived"},
               {"coverage", "cover [%]", true, 1, 100.0},
               {"causal_ate_m", "causal", true, 1, 1e3, false, "ATE [mm]"},
               {"final_ate_m", "final", true, 1, 1e3, false, "ATE [mm]"},
               {"added_m", "added by faults", true, 1, 1e3, false, "ATE [mm]"},
               {"largest_added_m", "largest", true, 1, 1e3, false, "ATE [mm]"},
               {"error_over_predicted", "err/pred", true, 1}});
  for (const BenchmarkSequence& sequence : record.sequences)
    for (const TrialVariant& variant : variants) {
      const auto which = [&](const TrialRun& run) {
        return run.recording == sequence.name && run.variant == variant;
      };
      const TrialSummary all = summaryOf(record, which);
      if (all.runs == 0) continue;
      const TrialSummary plain = summaryOf(
          record, [&](const TrialRun& run) { return which(run) && run.fault == kNoFault; });
      table.addRow();
      table.setText("recording", sequence.name);
      table.setText("variant", labelOf(variant, record));
      table.setText("survived", ofAll(all.survived, all.runs));
      table.setNumber("coverage", all.coverage);
      table.setNumber("causal_ate_m", plain.causal_ate_m.median);
      table.setNumber("final_ate_m", plain.final_ate_m.median);
      table.setNumber("added_m", all.added_ate_m.median);
      table.setNumber("largest_added_m", all.largest_added_ate_m);
      table.setNumber("error_over_predicted", plain.error_over_predicted.median);
    }
  return {"recordings", "By recording", "ATE: medians of the runs without a fault.", table};
}

TitledTable differenceTable(const TrialRecord& record, const std::vector<TrialVariant>& variants) {
  Table table({{"a", "what flew"},
               {"b", "less that of"},
               {"pairs", "runs", true, 0},
               {"difference_m", "ATE [mm]", true, 2, 1e3},
               {"low_m", "from", true, 2, 1e3, false, "95 % interval"},
               {"high_m", "to", true, 2, 1e3, false, "95 % interval"},
               {"verdict", "significant"}});
  for (size_t i = 1; i < variants.size(); ++i) {
    const BootstrapInterval d = differenceOfAte(record, variants[i], variants[0]);
    table.addRow();
    table.setText("a", labelOf(variants[i], record));
    table.setText("b", labelOf(variants[0], record));
    table.setNumber("pairs", d.pairs);
    table.setNumber("difference_m", d.difference);
    table.setNumber("low_m", d.low);
    table.setNumber("high_m", d.high);
    table.setText("verdict", d.significant() ? "yes" : "no");
  }
  return {"differences", "Differences of the causal ATE, without a fault",
          "Median of the differences over pairs of runs, paired bootstrap over recordings.", table};
}

TitledTable failureTable(const TrialRecord& record) {
  Table table({{"recording", "recording"},
               {"from_s", "from [s]", true, 1},
               {"variant", "what flew"},
               {"fault", "fault"},
               {"ate_m", "ATE [mm]", true, 1, 1e3},
               {"reason", "why it failed"},
               {"event", "what was said"}});
  for (const TrialRun& run : record.results) {
    if (run.survived()) continue;
    table.addRow();
    table.setText("recording", run.recording);
    table.setNumber("from_s", run.from_s);
    table.setText("variant", labelOf(run.variant, record));
    table.setText("fault", run.fault);
    table.setNumber("ate_m", run.causal.ate_m);
    table.setText("reason", run.reason);
    table.setText("event", run.event);
  }
  return {"failures", "Failures", table.rowCount() > 0 ? "" : "Every run survived.", table};
}

}  // namespace

std::vector<TitledTable> trialTables(const TrialRecord& record) {
  const std::vector<TrialVariant> variants = variantsOf(record);
  std::vector<TitledTable> tables = {variantTable(record, variants), faultTable(record, variants),
                                     afterStartTable(record, variants),
                                     recordingTable(record, variants)};
  if (variants.size() > 1) tables.push_back(differenceTable(record, variants));
  tables.push_back(failureTable(record));
  return tables;
}

std::string trialPage(const TrialRecord& record, const TextStyle& style, size_t lines) {
  constexpr size_t kWidth = 100;
  std::string page;
  for (const TitledTable& table : trialTables(record))
    if (table.headline) page += toString(table, TableFormat::kText, {style.mark, 0});
  const std::vector<FailureKind> failures = failuresOf(record);
  size_t used = std::count(page.begin(), page.end(), '\n');
  size_t named = 0, left = 0;
  for (const FailureKind& kind : failures) {
    if (used + 1 >= lines) {
      left += kind.runs.size();
      continue;
    }
    const TrialRun& run = record.results[kind.runs.front()];
    std::string line =
        (kind.runs.size() > 1 ? format("%zu failed, e.g. ", kind.runs.size()) : "failed: ") +
        run.recording + format(" %g s, ", run.from_s) + labelOf(run.variant, record) + ", " +
        run.fault + ": " + run.reason;
    if (displayWidth(line) > kWidth) line = line.substr(0, kWidth - 3) + "...";
    page += line + "\n";
    ++used;
    ++named;
  }
  if (left > 0) page += format("%zu more failed; runs.csv has every reason\n", left);
  return page;
}

}  // namespace etalon
