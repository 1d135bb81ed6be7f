#include <algorithm>
#include <filesystem>
#include <map>
#include <nlohmann/json.hpp>

#include "etalon/benchmark/trial/trial_store.h"
#include "etalon/benchmark/trial/trial_summary.h"
#include "etalon/core/text.h"
#include "etalon/evaluation/trajectory_evaluation.h"
#include "etalon/report/report.h"
#include "etalon/report/trial_tables.h"
#include "report_assets.h"
#include "report_page.h"

namespace etalon {
namespace {

using nlohmann::json;

/** Points that all trajectories of a page have together, about. */
constexpr size_t kMostPoints = 100'000;

/** The files of the trajectories, as the page needs them. */
class Paths {
 public:
  Paths(const TrialRecord& record, const std::string& folder) : record_(record), folder_(folder) {
    size_t frames = 0;
    for (const TrialRun& run : record.results) frames += static_cast<size_t>(run.poses);
    step_ = std::max<size_t>(5, frames / kMostPoints + 1);
  }

  /** Ground truth of a part at its images; empty where there is none. */
  const Trajectory& truth(const TrialRun& run) {
    const std::string path = groundTruthPath(folder_, run.recording, run.from_s);
    const auto [known, is_new] = truths_.try_emplace(path);
    if (is_new && std::filesystem::exists(path)) known->second = readTum(path);
    return known->second;
  }

  json topView(const Trajectory& trajectory) const {
    json points = json::array();
    for (size_t i = 0; i < trajectory.size(); i += step_)
      points.push_back({rounded(trajectory[i].T_WB.t.x()), rounded(trajectory[i].T_WB.t.y())});
    return points;
  }

  /** [t, x, y, error] of a run, aligned with ground truth in yaw and position; null without file. */
  json ofRun(const TrialRun& run) {
    const std::string path = trajectoryPath(folder_, record_, run);
    if (run.poses == 0 || !std::filesystem::exists(path)) return nullptr;
    Trajectory trajectory = readTum(path);
    std::map<TimeNs, double> errors;
    const AssociatedTrajectories both = associate(trajectory, truth(run));
    if (const auto alignment = alignmentOf(both, AlignmentType::kYawPosition)) {
      trajectory = transformed(trajectory, *alignment);
      for (const PoseError& e : poseErrors(associate(trajectory, truth(run))))
        errors[e.t] = e.position_m;
    }
    json points = json::array();
    for (size_t i = 0; i < trajectory.size(); i += step_) {
      const StampedPose& pose = trajectory[i];
      const auto error = errors.find(pose.t);
      points.push_back({rounded(secondsBetween(trajectory.front().t, pose.t)),
                        rounded(pose.T_WB.t.x()), rounded(pose.T_WB.t.y()),
                        error == errors.end() ? json(nullptr) : rounded(error->second)});
    }
    return points;
  }

 private:
  const TrialRecord& record_;
  const std::string& folder_;
  size_t step_ = 5;
  std::map<std::string, Trajectory> truths_;
};

json dataOf(const TrialRecord& record, const std::string& folder) {
  Paths paths(record, folder);
  const std::vector<TrialVariant> variants = variantsOf(record);
  json data = {{"variants", json::array()},
               {"faults", json::array()},
               {"parts", json::array()},
               {"runs", json::array()},
               {"after_start", json::object()}};
  for (const TrialVariant& variant : variants)
    data["variants"].push_back(pageText(labelOf(variant, record)));
  std::map<std::string, size_t> faults;
  for (const NamedText& fault : record.faults) {
    faults.emplace(fault.name, faults.size());
    data["faults"].push_back(pageText(fault.name));
  }
  std::map<std::pair<std::string, double>, size_t> parts;
  for (const TrialRun& run : record.results) {
    const auto [part, is_new] = parts.try_emplace({run.recording, run.from_s}, parts.size());
    if (is_new)
      data["parts"].push_back({{"recording", pageText(run.recording)},
                               {"from_s", run.from_s},
                               {"truth", paths.topView(paths.truth(run))}});
    const auto variant = std::find(variants.begin(), variants.end(), run.variant);
    data["runs"].push_back({part->second, variant - variants.begin(), faults.at(run.fault),
                            run.status, rounded(run.causal.ate_m), pageText(run.reason),
                            pageText(run.event), paths.ofRun(run)});
  }
  data["after_start"]["times"] = timesAfterStart();
  for (const TrialVariant& variant : variants) {
    json ates = json::array();
    for (const double after_s : timesAfterStart())
      ates.push_back(
          rounded(afterStart(record, variant, after_s, &ErrorsAfterStart::ate_m).median));
    data["after_start"]["ate_m"].push_back(ates);
  }
  return data;
}

std::string summaryOf(const TrialRecord& record) {
  const TrialSummary all = summaryOf(record, [](const TrialRun&) { return true; });
  std::string uncounted;
  for (const std::string& sentence : describeUncounted(record))
    uncounted += "<br><span class=\"bad\">" + escaped(sentence) + "</span>";
  const std::string recordings =
      joined(record.sequences, "<br>", [](const BenchmarkSequence& sequence) {
        return "<b>" + escaped(sequence.name) + "</b> " + escaped(sequence.source) +
               (sequence.error.empty()
                    ? ""
                    : " <span class=\"bad\">" + escaped(sequence.error) + "</span>");
      });
  const std::string faults = joined(record.faults, "<br>", [](const NamedText& fault) {
    return "<b>" + escaped(fault.name) + "</b> " + escaped(fault.text);
  });
  const std::string systems = joined(record.systems, "<br>", [](const NamedText& system) {
    return "<b>" + escaped(system.name) + "</b> " + escaped(system.text);
  });
  return term("Recordings", recordings) +
         term("Runs", std::to_string(all.survived) + " of " + std::to_string(all.runs) +
                          " survived, " + std::to_string(all.silent) + " wrong without a word" +
                          uncounted) +
         term("Survived", format("a pose for every frame since the fault, causal ATE at most %g m, "
                                 "not lost at the end",
                                 record.protocol.ate_limit_m)) +
         term("Faults", faults) + term("Other systems", systems) +
         term("Versions", versionsText(record.versions));
}

}  // namespace

std::string trialReportHtml(const TrialRecord& record, const std::string& folder) {
  std::string tables;
  for (const TitledTable& table : trialTables(record)) {
    tables += "<section class=\"table\"><h3>" + escaped(table.title) + "</h3>\n<p class=\"note\">" +
              escaped(table.note) + "</p>\n<div class=\"scroll\">" +
              pageText(table.table.toString(TableFormat::kHtml)) + "</div></section>\n";
  }
  return reportPage(report_assets::trialPage(), report_assets::trialScript(),
                    {{"title", "Etalon trial"},
                     {"summary", summaryOf(record)},
                     {"tables", tables},
                     {"config", escaped(record.config)}},
                    dataOf(record, folder));
}

}  // namespace etalon
