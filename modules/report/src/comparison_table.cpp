#include "etalon/report/comparison_table.h"

#include <algorithm>
#include <cmath>

#include "benchmark_side_tables.h"

namespace etalon {
namespace {

Table emptyComparison(bool one_source, bool all_succeeded) {
  return Table({{"run", "run"},
                {"source", "source", false, 0, 1.0, one_source},
                {"initializer", "initializer"},
                {"initialized_at_s", "init [s]", true, 2},
                {"attempts", "attempts", true, 0},
                {"status", "status", false, 0, 1.0, all_succeeded},
                {"stage", "stage"},
                {"rre_deg", "RRE [deg]", true, 4},
                {"ate_m", "ATE [mm]", true, 2, 1e3},
                {"gravity_deg", "gravity [deg]", true, 2},
                {"velocity_mps", "v [m/s]", true, 4},
                {"gyro_bias_rps", "b_g [rad/s]", true, 5},
                {"accel_bias_mps2", "b_a [m/s2]", true, 3},
                {"scale_error", "scale [-]", true, 4},
                {"ms", "time [ms]", true, 2},
                {"trajectory_ate_m", "flight's ATE [mm]", true, 1, 1e3}});
}

/** The last part of a path: the folder or file that it names. */
std::string lastPart(std::string path) {
  while (path.size() > 1 && path.back() == '/') path.pop_back();
  const size_t slash = path.rfind('/');
  return slash == std::string::npos || path.size() == 1 ? path : path.substr(slash + 1);
}

/** The accepted attempt, else the last that has a stage, else the last; null if there is none. */
const AttemptRecord* attemptToShow(const RunRecord& record) {
  if (const AttemptRecord* accepted = record.acceptedAttempt()) return accepted;
  for (auto attempt = record.attempts.rbegin(); attempt != record.attempts.rend(); ++attempt)
    if (!attempt->stages.empty()) return &*attempt;
  return record.attempts.empty() ? nullptr : &record.attempts.back();
}

/** Start and whole ATE, which stand in both tables. */
void setRunNumbers(Table* table, const RunRecord& record) {
  if (record.initialized_at)
    table->setNumber("initialized_at_s",
                     secondsBetween(record.first_image, *record.initialized_at));
  if (record.trajectory_errors)
    table->setNumber("trajectory_ate_m", record.trajectory_errors->position_m.rmse);
}

/** Of VI-BA alone, or of the initializer with the stereo odometry that it asked for. */
double runtimeOf(const AttemptRecord& attempt, const StageRecord& stage) {
  if (stage.stage != kStageInit) return attempt.milliseconds(stage.stage);
  const double odometry_ms = attempt.milliseconds(kTimingStereoOdometry);
  return attempt.milliseconds(kTimingInitialize) + (std::isnan(odometry_ms) ? 0.0 : odometry_ms);
}

void addRunCells(Table* table, const std::string& name, const RunRecord& record,
                 const AttemptRecord* attempt) {
  table->addRow();
  table->setText("run", name);
  table->setText("source", lastPart(record.source));
  table->setText("initializer", record.initializer);
  setRunNumbers(table, record);
  table->setNumber("attempts", static_cast<double>(record.attempts.size()));
  table->setText("status", attempt ? attempt->status : "no attempt");
}

void addStageCells(Table* table, const AttemptRecord& attempt, const StageRecord& stage) {
  table->setText("stage", stage.stage);
  table->setNumber("ms", runtimeOf(attempt, stage));
  if (!stage.errors) return;
  table->setNumber("rre_deg", stage.errors->rre_deg);
  table->setNumber("ate_m", stage.errors->ate_m);
  table->setNumber("gravity_deg", stage.errors->gravity_deg);
  table->setNumber("velocity_mps", stage.errors->velocity_mps);
  table->setNumber("gyro_bias_rps", stage.errors->gyro_bias_rps);
  table->setNumber("accel_bias_mps2", stage.errors->accel_bias_mps2);
  table->setNumber("scale_error", stage.errors->scale_error);
}

}  // namespace

Table compareRuns(const std::vector<std::pair<std::string, RunRecord>>& runs) {
  bool one_source = true, all_succeeded = true;
  for (const auto& [name, record] : runs) {
    one_source = one_source && record.source == runs.front().second.source;
    all_succeeded = all_succeeded && record.acceptedAttempt() != nullptr;
  }
  Table table = emptyComparison(one_source, all_succeeded);
  for (const auto& [name, record] : runs) {
    const AttemptRecord* attempt = attemptToShow(record);
    if (!attempt || attempt->stages.empty()) {
      addRunCells(&table, name, record, attempt);
      continue;
    }
    for (const StageRecord& stage : attempt->stages) {
      addRunCells(&table, name, record, attempt);
      addStageCells(&table, *attempt, stage);
    }
  }
  return table;
}

Table compareRunsBriefly(const std::vector<std::pair<std::string, RunRecord>>& runs) {
  std::vector<Table::Column> columns = {
      {"run", "run"}, {"initializer", "initializer"}, {"initialized_at_s", "start [s]", true, 2}};
  const auto named = [](const auto& run) { return run.first == run.second.initializer; };
  if (std::all_of(runs.begin(), runs.end(), named)) columns.erase(columns.begin() + 1);
  const auto add = [&columns](const std::string& key, const std::string& title, int decimals,
                              const std::string& stage, double factor = 1.0) {
    columns.push_back(
        {key + stage, title, true, decimals, factor, false, stage.empty() ? "" : groupOf(stage)});
  };
  add("rre_deg", "RRE [deg]", 4, kStageInit);
  for (const std::string stage : {kStageInit, kStageViBa}) {
    add("gravity_deg", "grav. [deg]", 2, stage);
    add("velocity_mps", "v [m/s]", 4, stage);
    add("ms", "[ms]", 2, stage);
  }
  columns.push_back({"trajectory_ate_m", "ATE [mm]", true, 1, 1e3, false, "flight"});
  Table table(columns);
  for (const auto& [name, record] : runs) {
    table.addRow();
    table.setText("run", name);
    if (table.hasColumn("initializer")) table.setText("initializer", record.initializer);
    setRunNumbers(&table, record);
    const AttemptRecord* attempt = attemptToShow(record);
    if (!attempt) continue;
    for (const StageRecord& stage : attempt->stages) {
      table.setNumber("ms" + stage.stage, runtimeOf(*attempt, stage));
      if (!stage.errors) continue;
      if (stage.stage == kStageInit)
        table.setNumber("rre_deg" + stage.stage, stage.errors->rre_deg);
      table.setNumber("gravity_deg" + stage.stage, stage.errors->gravity_deg);
      table.setNumber("velocity_mps" + stage.stage, stage.errors->velocity_mps);
    }
  }
  return table;
}

std::vector<std::string> refusalsOf(const std::vector<std::pair<std::string, RunRecord>>& runs) {
  std::vector<std::string> sentences;
  for (const auto& [name, record] : runs) {
    if (record.acceptedAttempt()) continue;
    std::string sentence = name + ": never initialized; ";
    if (record.attempts.empty()) {
      sentence += "the window of keyframes was never full";
    } else {
      const AttemptRecord& last = record.attempts.back();
      sentence += std::to_string(record.attempts.size()) +
                  (record.attempts.size() == 1 ? " attempt" : " attempts") +
                  ", the last one: " + last.status + ", " + last.reason;
    }
    sentences.push_back(sentence);
  }
  return sentences;
}

}  // namespace etalon
