#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <utility>

#include "commands.h"
#include "etalon/benchmark/sequence_tracks.h"
#include "etalon/benchmark/store.h"
#include "etalon/benchmark/trial/trajectory_trial.h"
#include "etalon/benchmark/trial/trial_summary.h"
#include "etalon/core/errors.h"
#include "etalon/core/printable.h"
#include "etalon/core/text.h"
#include "etalon/datasets/sensor_source.h"
#include "etalon/report/benchmark_comparison.h"
#include "etalon/report/benchmark_overview.h"
#include "etalon/report/comparison_table.h"
#include "etalon/report/plot.h"
#include "etalon/report/trial_tables.h"
#include "etalon/runlog/run_log.h"
#include "support/checks.h"
#include "support/print_tables.h"
#include "support/systems.h"

namespace etalon::app {

namespace {

namespace fs = std::filesystem;

struct CompareArguments {
  std::vector<std::string> runs, initializers, metrics, recordings;
  std::string format = "text", plot;
  std::uint64_t seed = BootstrapOptions().seed;
  double min_coverage = kMinCoverage;
  bool bold = false, all = false, verbose = false;
};

bool isForPeople(TableFormat format) { return format != TableFormat::kCsv; }

/** The folder of a run that is named by it or by its run.rawlog; empty for the working folder. */
fs::path folderOf(const std::string& path) {
  const fs::path folder = fs::path(path).lexically_normal();
  return folder.filename() == kRunLogName || !folder.has_filename() ? folder.parent_path() : folder;
}

/** The folders' names without their parents, if these differ; else the paths as they are. */
std::vector<std::string> shortNames(const std::vector<std::string>& paths) {
  std::vector<std::string> names;
  for (const std::string& path : paths) {
    const std::string name = folderOf(path).filename().string();
    if (name.empty() || std::count(names.begin(), names.end(), name) > 0) return paths;
    names.push_back(name);
  }
  return names;
}

/** Draws the runs' trajectories, with the ground truth of their recording where it is still there. */
void drawRuns(const CompareArguments& arguments,
              const std::vector<std::pair<std::string, RunRecord>>& runs) {
  std::vector<NamedTrajectory> trajectories;
  for (size_t i = 0; i < runs.size(); ++i)
    trajectories.push_back(
        {runs[i].first, readTum((folderOf(arguments.runs[i]) / "trajectory.tum").string())});
  GroundTruth truth;
  SourceOptions options;
  options.decode_images = false;
  try {
    truth = openSource(runs.front().second.source, options)->groundTruth();
  } catch (const DataError& error) {
    std::fprintf(stderr, "warning: drawn without ground truth: %s\n",
                 printable(error.what()).c_str());
  }
  drawTrajectories(arguments.plot, trajectories, truth);
}

/** Says which runs are of another recording, or of another part of it, than the first. */
void warnOfOtherRecordings(const std::vector<std::pair<std::string, RunRecord>>& runs) {
  constexpr double kToleranceS = 0.2;  // a fault may have taken the first or last images
  const auto& [first_name, first] = runs.front();
  const std::string recording = recordingName(first.source);
  for (const auto& [name, run] : runs) {
    const std::string other = recordingName(run.source);
    const double later_s = secondsBetween(first.first_image, run.first_image);
    const double longer_s = run.statistics.duration_s - first.statistics.duration_s;
    const bool same_part = std::abs(later_s) <= kToleranceS && std::abs(longer_s) <= kToleranceS;
    if (same_part && other == recording) continue;
    std::string what =
        format("of another recording (%s, not %s)", other.c_str(), recording.c_str());
    if (other == recording)
      what = format("of another part of %s (%.2f s, which begin %+.2f s after those %.2f s)",
                    recording.c_str(), run.statistics.duration_s, later_s,
                    first.statistics.duration_s);
    std::fprintf(stderr, "warning: %s is a run %s than %s: their errors cannot be compared\n",
                 printable(name).c_str(), printable(what).c_str(), printable(first_name).c_str());
  }
}

void compareRunFolders(const CompareArguments& arguments, TableFormat format) {
  const std::vector<std::string> names =
      isForPeople(format) ? shortNames(arguments.runs) : arguments.runs;
  std::vector<std::pair<std::string, RunRecord>> runs;
  for (size_t i = 0; i < names.size(); ++i)
    runs.emplace_back(names[i], readRunRecord(arguments.runs[i]));
  for (auto& [name, record] : runs) requireCoverage(&record, arguments.min_coverage);
  warnOfOtherRecordings(runs);
  const bool brief = format == TableFormat::kText && !arguments.verbose;
  const Table table = brief ? compareRunsBriefly(runs) : compareRuns(runs);
  std::fputs(table.toString(format).c_str(), stdout);
  for (const auto& [name, record] : runs) {
    if (!record.ground_truth) continue;
    const std::string partly = describeCoverage(*record.ground_truth, arguments.min_coverage);
    if (!partly.empty()) std::fprintf(stderr, "warning: %s: %s\n", name.c_str(), partly.c_str());
  }
  if (!arguments.plot.empty()) drawRuns(arguments, runs);
  const std::vector<std::string> refusals = refusalsOf(runs);
  if ((format == TableFormat::kText || format == TableFormat::kMarkdown) && !refusals.empty()) {
    std::printf("\n");
    for (const std::string& sentence : refusals) std::printf("%s\n", sentence.c_str());
  }
}

/** Whether to print a table beside the comparison: all, the headlines, or the chosen figures. */
bool isAskedFor(const TitledTable& table, const std::vector<std::string>& metrics, bool all) {
  if (all) return true;
  if (metrics.empty()) return table.headline;
  return std::find(metrics.begin(), metrics.end(), table.figure) != metrics.end();
}

/** Compares the first initializer with each of the others. */
std::vector<PairedComparison> comparisonsWithTheFirst(const BenchmarkRecord& record,
                                                      const std::vector<std::string>& figures,
                                                      const BootstrapOptions& options) {
  const std::vector<std::string> names = initializersOf(record);
  std::vector<PairedComparison> comparisons;
  for (size_t k = 1; k < names.size(); ++k) {
    const auto pair = comparePaired(record, names[0], names[k], figures, options);
    comparisons.insert(comparisons.end(), pair.begin(), pair.end());
  }
  return comparisons;
}

/** The comparisons of one shape of window. */
std::vector<PairedComparison> ofShape(const std::vector<PairedComparison>& comparisons,
                                      const WindowShape& shape) {
  std::vector<PairedComparison> chosen;
  for (const PairedComparison& c : comparisons)
    if (c.keyframes == shape.keyframes && c.rate_hz == shape.rate_hz) chosen.push_back(c);
  return chosen;
}

/** Prints a text table for each pair of initializers and window: with their names in every row it
 * would be wider than most terminals. The note, which is the same for all, comes last. */
void printComparisons(const std::vector<PairedComparison>& comparisons,
                      const BootstrapOptions& options, const TextStyle& style) {
  auto first = comparisons.begin();
  while (first != comparisons.end()) {
    const auto last = std::find_if(first, comparisons.end(), [&](const PairedComparison& c) {
      return c.b != first->b || c.keyframes != first->keyframes || c.rate_hz != first->rate_hz;
    });
    TitledTable table = comparisonTable({first, last}, options, true);
    table.note.clear();
    std::printf("%s\n", toString(table, TableFormat::kText, style).c_str());
    first = last;
  }
  std::printf("%s\n", comparisonTable(comparisons, options).note.c_str());
}

/** Prints, for each shape of window, one table of all initializers and one of their verdicts. */
void printOneScreen(const BenchmarkRecord& record, const std::vector<PairedComparison>& comparisons,
                    const BootstrapOptions& options, const TextStyle& style) {
  printOverview(record, style);
  if (comparisons.empty()) return;
  for (const WindowShape& shape : shapesOf(record))
    std::printf("%s\n", toString(comparisonOverview(ofShape(comparisons, shape), options),
                                 TableFormat::kText, style)
                            .c_str());
}

/** Says what the benchmarks lack, on stdout above tables for people, else on stderr. Returns
 * whether they lack anything. */
bool printIncompleteness(const std::vector<std::pair<std::string, BenchmarkRecord>>& benchmarks,
                         TableFormat format) {
  bool any = false;
  for (const auto& [name, record] : benchmarks) {
    for (const std::string& sentence : incompleteness(record)) {
      std::fprintf(isForPeople(format) ? stdout : stderr, "INCOMPLETE: %s: %s\n",
                   printable(name).c_str(), printable(sentence).c_str());
      any = true;
    }
  }
  if (any && isForPeople(format)) std::printf("The tables hold what is there.\n\n");
  return any;
}

/** Compares benchmarks. Returns whether they are complete. */
bool compareBenchmarkFolders(const CompareArguments& arguments, TableFormat format) {
  const std::vector<std::string> names = shortNames(arguments.runs);
  std::vector<std::pair<std::string, BenchmarkRecord>> benchmarks;
  for (size_t i = 0; i < names.size(); ++i)
    benchmarks.emplace_back(names[i], readBenchmark(arguments.runs[i]));
  const bool complete = !printIncompleteness(benchmarks, format);
  BenchmarkRecord record = combineBenchmarks(benchmarks);
  if (!arguments.initializers.empty()) record = selectInitializers(record, arguments.initializers);
  requireCoverage(&record, arguments.min_coverage);
  for (const std::string& sentence : describeCoverage(record, arguments.min_coverage))
    std::fprintf(stderr, "warning: %s\n", sentence.c_str());
  const bool several = initializersOf(record).size() > 1;
  if (!several && !isForPeople(format))
    throw ConfigError("format '" + arguments.format +
                      "' holds the comparison of initializers, and there is only one; its figures "
                      "are in summary.csv");

  BootstrapOptions options;
  options.seed = arguments.seed;
  const bool one_screen = format == TableFormat::kText && !arguments.verbose && !arguments.all &&
                          arguments.metrics.empty();
  if (one_screen) options.resamples = 2000;  // enough for a verdict; intervals have 10000
  std::vector<std::string> figures = arguments.metrics;
  if (figures.empty()) figures = one_screen ? overviewFigures() : comparedFigures();
  const std::vector<PairedComparison> comparisons =
      comparisonsWithTheFirst(record, figures, options);
  const TextStyle style = textStyle(arguments.bold);
  if (one_screen) {
    printOneScreen(record, comparisons, options, style);
    return complete;
  }
  if (isForPeople(format))
    for (const TitledTable& table : benchmarkTables(record))
      if (isAskedFor(table, arguments.metrics, arguments.all))
        std::printf("%s\n", toString(table, format, style).c_str());
  if (!several) return complete;
  if (format == TableFormat::kText)
    printComparisons(comparisons, options, style);
  else if (isForPeople(format))
    std::fputs(toString(comparisonTable(comparisons, options), format).c_str(), stdout);
  else
    std::fputs(comparisonTable(comparisons, options).table.toString(format).c_str(), stdout);
  return complete;
}

/** Draws the trajectories that systems have of the whole of the first recording. */
void drawSystems(const CompareArguments& arguments, const std::vector<NamedText>& systems) {
  const std::string& recording = arguments.recordings.front();
  std::vector<NamedTrajectory> trajectories;
  for (const NamedText& system : systems) {
    fs::path file = system.text;
    if (fs::is_directory(file)) file /= recordingName(recording) + ".tum";
    if (fs::exists(file)) trajectories.push_back({system.name, readTum(file.string())});
  }
  SourceOptions options;
  options.decode_images = false;
  drawTrajectories(arguments.plot, trajectories, openSource(recording, options)->groundTruth());
}

/** Trajectories of any system, TUM files, judged as `etalon trial` judges them. */
void compareTrajectories(const CompareArguments& arguments, TableFormat format) {
  const std::vector<NamedText> systems = systemsOf(arguments.runs, arguments.recordings.size());
  const TrialRecord record = trialOfTrajectories(systems, arguments.recordings, TrialProtocol());
  if (!arguments.plot.empty()) drawSystems(arguments, systems);
  if (format == TableFormat::kText && !arguments.verbose)
    std::fputs(trialPage(record, textStyle(arguments.bold)).c_str(), stdout);
  else if (format == TableFormat::kCsv)
    std::fputs(runsCsv(record.results).c_str(), stdout);
  else
    for (const TitledTable& table : trialTables(record))
      std::printf("%s\n", toString(table, format).c_str());
  for (const std::string& sentence : describeUncounted(record))
    std::fprintf(stderr, "warning: %s\n", printable(sentence).c_str());
}

int compare(const CompareArguments& arguments) {
  const TableFormat format = tableFormatFromName(arguments.format);
  if (!arguments.recordings.empty()) {
    compareTrajectories(arguments, format);
    return kOk;
  }
  const auto benchmarks =
      std::count_if(arguments.runs.begin(), arguments.runs.end(), isBenchmarkFolder);
  if (benchmarks == static_cast<std::ptrdiff_t>(arguments.runs.size()))
    return compareBenchmarkFolders(arguments, format) ? kOk : kIncomplete;
  if (benchmarks > 0)
    throw ConfigError("runs and benchmarks together: expected folders of one kind");
  if (!arguments.initializers.empty() || !arguments.metrics.empty())
    throw ConfigError("--initializers and --metric: expected folders of benchmarks");
  compareRunFolders(arguments, format);
  return kOk;
}

}  // namespace

void addCompareCommand(CLI::App& app, int* exit_code) {
  auto arguments = std::make_shared<CompareArguments>();
  CLI::App* command = app.add_subcommand(
      "compare",
      "Print a table of runs: errors before and after VI-BA, times, refusals; or the tables of "
      "benchmarks, and which differences between initializers are significant.");
  command
      ->add_option("RUN", arguments->runs,
                   "Folder of a run, or its run.rawlog; or folders of benchmarks; with "
                   "--recording trajectories of any system: TUM files, or folders of them")
      ->required();
  command
      ->add_option("--recording", arguments->recordings,
                   "RUN are trajectories of these recordings: RECORDING.tum or "
                   "RECORDING-FROM-FAULT.tum; repeatable. Of one recording any TUM file, or the "
                   "folder of a run")
      ->allow_extra_args(false);
  command->add_option("--format", arguments->format, "How to print the table")
      ->check(CLI::IsMember(tableFormatNames()))
      ->capture_default_str();
  command
      ->add_option("--initializers", arguments->initializers,
                   "Benchmarks: these alone, comma between; the first is compared with the others")
      ->delimiter(',')
      ->allow_extra_args(false);
  command
      ->add_option("--metric", arguments->metrics,
                   "Benchmarks: these figures alone, comma between, e.g. success,rre_deg")
      ->check(CLI::IsMember(comparedFigures()))
      ->delimiter(',')
      ->allow_extra_args(false);
  command
      ->add_option("--min-coverage", arguments->min_coverage,
                   "Share of the frames of a run, or of a window's keyframes, that must have "
                   "ground truth; with less, errors are not given")
      ->check(checkShare())
      ->capture_default_str();
  command->add_flag(
      "-v,--verbose", arguments->verbose,
      "Benchmarks, as text: a table for each figure with a row for each recording, and "
      "the differences with their intervals");
  command->add_flag("--all", arguments->all,
                    "Benchmarks: print all tables, as `etalon bench --format markdown` does");
  command
      ->add_option("--save-plot", arguments->plot,
                   "Runs, and trajectories with --recording: draw them into this .png or .svg file")
      ->check(checkOutputPath());
  command->add_option("--seed", arguments->seed, "Benchmarks: of the bootstrap")
      ->check(checkWholeNumber())
      ->capture_default_str();
  command->add_flag("--bold", arguments->bold,
                    "Benchmarks, as text: the best of a row in bold, even if this is no terminal");
  command->footer(
      glossary() +
      "Exit codes: 0 done, 1 done, but a benchmark is unfinished or lacks recordings (said above "
      "the tables), 2 usage or configuration, 3 data.");
  command->callback([arguments, exit_code] { *exit_code = compare(*arguments); });
}

}  // namespace etalon::app
