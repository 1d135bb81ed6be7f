#include <cmath>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <memory>
#include <optional>
#include <utility>

#include "commands.h"
#include "etalon/benchmark/ground_truth_coverage.h"
#include "etalon/core/errors.h"
#include "etalon/core/text.h"
#include "etalon/datasets/ground_truth_file.h"
#include "etalon/datasets/sensor_source.h"
#include "etalon/evaluation/time_shift.h"
#include "etalon/evaluation/trajectory_evaluation.h"
#include "etalon/report/plot.h"
#include "etalon/report/table.h"
#include "support/checks.h"

namespace etalon::app {

namespace {

struct EvaluateArguments {
  std::string trajectory, ground_truth, align = "all", unit = "frames", format = "text", plot;
  std::optional<double> delta;
  double max_time_difference_s = 0.01, min_coverage = kMinCoverage;
  bool estimate_offset = false, verbose = false;
};

struct NamedAlignment {
  std::string option, title;
  std::optional<AlignmentType> type;
};

std::vector<NamedAlignment> alignments() {
  return {{"none", "none", std::nullopt},
          {"se3", "SE(3)", AlignmentType::kSE3},
          {"sim3", "Sim(3)", AlignmentType::kSim3},
          {"yaw", "yaw and position", AlignmentType::kYawPosition}};
}

AssociatedTrajectories associated(const EvaluateArguments& arguments, const Trajectory& estimate,
                                  const GroundTruth& truth) {
  Trajectory reference;
  for (const StampedState& state : truth.states) reference.push_back({state.t, state.T_WB});
  AssociatedTrajectories pair = associate(estimate, reference, arguments.max_time_difference_s);
  const size_t covered = coveredPoses(estimate, pair);
  if (!pair.estimate.empty() && !coversEnough(covered, estimate.size(), arguments.min_coverage)) {
    const std::string wanted =
        format("%g of them and at least %zu", arguments.min_coverage, kMinCoveredPoses);
    throw DataError(arguments.trajectory, 0,
                    std::to_string(covered) + " of " + std::to_string(estimate.size()) +
                        " poses are covered by " + arguments.ground_truth +
                        ": their errors say nothing of the trajectory; expected a share of " +
                        wanted + " (see --min-coverage)");
  }
  if (!pair.estimate.empty()) return pair;
  const std::string limit = format("%g", arguments.max_time_difference_s);
  throw DataError(arguments.trajectory, 0,
                  "no pose has one of " + arguments.ground_truth + " within " + limit +
                      " s; expected stamps of the same clock (see --max-time-difference)");
}

std::vector<RelativeDelta> deltas(const EvaluateArguments& arguments) {
  const DeltaUnit unit = deltaUnitFromName(arguments.unit);
  if (arguments.delta) return {{*arguments.delta, unit}};
  return {{1, DeltaUnit::kFrames}, {10, DeltaUnit::kFrames}, {1, DeltaUnit::kMeters}};
}

/** @param verbose all statistics, not those that fit into 100 columns alone; CSV always has all */
Table emptyTable(bool verbose) {
  std::vector<Table::Column> columns = {
      {"error", "error"}, {"over", "alignment or delta"}, {"count", "count", true, 0}};
  for (const auto& [prefix, group, unit, factor] :
       {std::tuple("position_", "position [mm]", "_m", 1e3),
        std::tuple("rotation_", "rotation [deg]", "_deg", 1.0)})
    for (const auto& [name, headline] :
         {std::pair("rmse", true), std::pair("mean", false), std::pair("median", true),
          std::pair("std", false), std::pair("min", false), std::pair("max", true)})
      columns.push_back({std::string(prefix) + name + unit, name, true, factor > 1.0 ? 3 : 4,
                         factor, !headline && !verbose, group});
  columns.push_back({"position_sse_m2", "sse", true, 6, 1.0, true});
  columns.push_back({"rotation_sse_deg2", "sse", true, 6, 1.0, true});
  return Table(columns);
}

/** Adds a row, unless there is no pair of poses for the errors. */
void addErrors(Table* table, const std::string& error, const std::string& over,
               const TrajectoryErrors& errors) {
  if (errors.position_m.count == 0) return;
  table->addRow();
  table->setText("error", error);
  table->setText("over", over);
  table->setNumber("count", static_cast<double>(errors.position_m.count));
  const auto set = [&](const std::string& prefix, const std::string& unit,
                       const ErrorStatistics& s) {
    table->setNumber(prefix + "rmse" + unit, s.rmse);
    table->setNumber(prefix + "mean" + unit, s.mean);
    table->setNumber(prefix + "median" + unit, s.median);
    table->setNumber(prefix + "std" + unit, s.std);
    table->setNumber(prefix + "min" + unit, s.min);
    table->setNumber(prefix + "max" + unit, s.max);
    table->setNumber(prefix + "sse" + unit + "2", s.sse);
  };
  set("position_", "_m", errors.position_m);
  set("rotation_", "_deg", errors.rotation_deg);
}

std::string describe(const RelativeDelta& delta) {
  return format("%g %s", delta.length,
                delta.unit == DeltaUnit::kMeters ? "m"
                : delta.length == 1.0            ? "frame"
                                                 : "frames");
}

/** The time shift of least ATE, in words; beside a table for programs on standard error. */
void printOffset(const EvaluateArguments& arguments, const Trajectory& estimate,
                 const GroundTruth& truth, TableFormat format) {
  const auto shift = estimateTimeShift(estimate, truth);
  if (!shift) throw DataError(arguments.ground_truth, 0, "no time shift: " + shift.error().reason);
  const double ms = 1e3 * shift->shift_s;
  std::fprintf(
      format == TableFormat::kText || format == TableFormat::kMarkdown ? stdout : stderr,
      "ground truth is %.2f +- %.2f ms %s; ATE aligned in SE(3) %.3f mm with its stamps, %.3f "
      "mm shifted (%zu poses)\n",
      std::abs(ms), 1e3 * shift->sigma_s, ms < 0.0 ? "late" : "early",
      1e3 * shift->before.position_m.rmse, 1e3 * shift->after.position_m.rmse,
      shift->after.position_m.count);
}

void evaluate(const EvaluateArguments& arguments) {
  if (arguments.ground_truth.empty())
    throw ConfigError("evaluate: expected a ground truth after the trajectory: etalon evaluate " +
                      arguments.trajectory + " GT");
  const TableFormat format = tableFormatFromName(arguments.format);
  if (std::filesystem::is_directory(arguments.trajectory)) {
    const std::filesystem::path flown =
        std::filesystem::path(arguments.trajectory) / "trajectory.tum";
    throw DataError(arguments.trajectory, 0,
                    "is a folder; expected a TUM file" +
                        (std::filesystem::exists(flown) ? ", here " + flown.string() : ""));
  }
  const Trajectory estimate = readTum(arguments.trajectory);
  if (estimate.size() < kMinCoveredPoses)
    throw DataError(arguments.trajectory, 0,
                    "expected at least " + std::to_string(kMinCoveredPoses) + " poses, found " +
                        std::to_string(estimate.size()) + ": fewer can be aligned with anything");
  const GroundTruth truth = readGroundTruth(arguments.ground_truth);
  const AssociatedTrajectories pair = associated(arguments, estimate, truth);

  Table table = emptyTable(arguments.verbose);
  table.setCaption(std::to_string(pair.estimate.size()) + " of " + std::to_string(estimate.size()) +
                   " poses of " + arguments.trajectory + "\nassociated with " +
                   arguments.ground_truth + ", which covers " +
                   std::to_string(coveredPoses(estimate, pair)) + " of them");
  for (const NamedAlignment& alignment : alignments())
    if (arguments.align == "all" || arguments.align == alignment.option)
      addErrors(&table, "ATE", alignment.title, absoluteErrors(pair, alignment.type));
  std::vector<std::string> too_long;
  for (const RelativeDelta& delta : deltas(arguments)) {
    const TrajectoryErrors errors = relativeErrors(pair, delta);
    if (errors.position_m.count == 0) too_long.push_back(describe(delta));
    addErrors(&table, "RPE", describe(delta), errors);
  }
  std::fputs(table.toString(format).c_str(), stdout);
  for (const std::string& delta : too_long)
    std::fprintf(stderr, "warning: no two poses are %s apart: there is no RPE over that length\n",
                 delta.c_str());
  if (arguments.estimate_offset) printOffset(arguments, estimate, truth, format);

  if (arguments.plot.empty()) return;
  TrajectoryPlotOptions plot;
  plot.title = std::filesystem::path(arguments.trajectory).filename().string();
  plot.pairs = pair;
  plot.alignment = AlignmentType::kSE3;
  for (const NamedAlignment& alignment : alignments())
    if (arguments.align == alignment.option) plot.alignment = alignment.type;
  drawTrajectoryPlot(arguments.plot, estimate, truth, plot);
}

}  // namespace

void addEvaluateCommand(CLI::App& app, int* exit_code) {
  auto arguments = std::make_shared<EvaluateArguments>();
  CLI::App* command = app.add_subcommand(
      "evaluate", "Print the errors of any trajectory (ATE, RPE), as evo computes them.");
  command->add_option("TRAJECTORY", arguments->trajectory, "TUM file: t x y z qx qy qz qw")
      ->required();
  command->add_option("GT,--ground-truth", arguments->ground_truth,
                      "Ground truth: TUM file, EuRoC CSV, EuRoC folder or .rawlog; it is needed, "
                      "after TRAJECTORY or by its name");
  command->add_flag("--estimate-offset", arguments->estimate_offset,
                    "Also find the time shift of the ground truth that makes the ATE least");
  command->add_option("--align", arguments->align, "Alignment of the ATE")
      ->check(CLI::IsMember({"all", "none", "se3", "sim3", "yaw"}))
      ->capture_default_str();
  CLI::Option* delta = command->add_option(
      "--delta", arguments->delta,
      "Length over which motion is compared for the RPE; without: 1 frame, 10 frames, 1 m");
  command->add_option("--unit", arguments->unit, "Unit of --delta")
      ->check(CLI::IsMember({"frames", "meters"}))
      ->needs(delta)
      ->capture_default_str();
  command
      ->add_option("--max-time-difference", arguments->max_time_difference_s,
                   "Poses further apart in time are not associated, s")
      ->check(checkSeconds(true))
      ->capture_default_str();
  command
      ->add_option(
          "--min-coverage", arguments->min_coverage,
          "Share of the poses that must have ground truth; with less, errors are not given")
      ->check(checkShare())
      ->capture_default_str();
  command->add_option("--format", arguments->format, "How to print the table")
      ->check(CLI::IsMember(tableFormatNames()))
      ->capture_default_str();
  command->add_flag("-v,--verbose", arguments->verbose, "Also mean, standard deviation and least");
  command->add_option("--save-plot,--plot", arguments->plot,
                      "Draw the trajectory into this .png or .svg file");
  command->callback([arguments, exit_code] {
    evaluate(*arguments);
    *exit_code = kOk;
  });
}

}  // namespace etalon::app
