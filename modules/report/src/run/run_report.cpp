#include <algorithm>
#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include "etalon/core/statistics.h"
#include "etalon/core/text.h"
#include "etalon/evaluation/flight_errors.h"
#include "etalon/evaluation/trajectory_evaluation.h"
#include "etalon/report/comparison_table.h"
#include "etalon/report/report.h"
#include "report_assets.h"
#include "report_page.h"

namespace etalon {
namespace {

using Json = nlohmann::json;

constexpr size_t kRows = 3000;  ///< at most so many frames are drawn
/** Positions farther away are not drawn, m. */
constexpr double kFarthestDrawn = 1e9;

constexpr PipelineState kStates[] = {PipelineState::kWaiting, PipelineState::kVisual,
                                     PipelineState::kInertial, PipelineState::kDeadReckoning,
                                     PipelineState::kLost};

bool canBeDrawn(const FrameEstimate& e) {
  return e.nav.T_WB.t.allFinite() && e.nav.T_WB.t.norm() < kFarthestDrawn;
}

/** A row for each frame that is drawn; its columns stand in page/run.js. */
Json rowsOf(const std::vector<FrameEstimate>& estimates, const std::vector<FlightErrors>& errors,
            const GroundTruth& ground_truth, TimeNs first_image) {
  std::vector<size_t> drawn;
  const size_t step = std::max<size_t>(1, (estimates.size() + kRows - 1) / kRows);
  for (size_t i = 0; i < estimates.size(); i += step)
    if (canBeDrawn(estimates[i])) drawn.push_back(i);
  Trajectory trajectory;
  for (const size_t i : drawn) trajectory.push_back({estimates[i].t, estimates[i].nav.T_WB});
  if (const auto alignment =
          alignmentOf(associate(trajectory, ground_truth), AlignmentType::kYawPosition))
    trajectory = transformed(trajectory, *alignment);
  Json rows = Json::array();
  for (size_t k = 0; k < drawn.size(); ++k) {
    const FrameEstimate& e = estimates[drawn[k]];
    Json row = {rounded(secondsBetween(first_image, e.t)), static_cast<int>(e.state)};
    for (int i = 0; i < 3; ++i) row.push_back(rounded(trajectory[k].T_WB.t[i]));
    const auto truth = ground_truth.at(e.t);
    for (int i = 0; i < 3; ++i) row.push_back(truth ? rounded(truth->T_WB.t[i]) : Json(nullptr));
    for (const FlightFigure& figure : flightFigures()) {
      const ErrorAndSigma& predicted = errors[drawn[k]].*figure.member;
      row.push_back(rounded(predicted.error));
      row.push_back(rounded(predicted.sigma));
    }
    rows.push_back(std::move(row));
  }
  return rows;
}

Json flightData(const RunRecord& record, const std::vector<FrameEstimate>& estimates,
                const std::vector<FlightErrors>& errors, const GroundTruth& ground_truth) {
  Json data;
  data["initialized_at_s"] = nullptr;
  if (record.initialized_at)
    data["initialized_at_s"] = secondsBetween(record.first_image, *record.initialized_at);
  data["states"] = Json::array();
  for (const PipelineState state : kStates) data["states"].push_back(toString(state));
  data["figures"] = Json::array();
  for (const FlightFigure& f : flightFigures())
    data["figures"].push_back(
        {{"key", f.key}, {"name", f.name}, {"unit", f.unit}, {"factor", f.factor}});
  data["events"] = Json::array();
  for (const EventRecord& event : record.events)
    data["events"].push_back({{"t", rounded(secondsBetween(record.first_image, event.t))},
                              {"state", event.state},
                              {"reason", pageText(event.reason)},
                              {"remark", event.remark}});
  data["rows"] = rowsOf(estimates, errors, ground_truth, record.first_image);
  return data;
}

std::string section(const std::string& title, const Table& table) {
  if (table.rowCount() == 0) return "";
  return "<section class=\"table\"><h3>" + title + "</h3>\n<div class=\"scroll\">" +
         pageText(table.toString(TableFormat::kHtml)) + "</div></section>\n";
}

/** A name of the files as people read it: "dead reckoning". */
std::string spaced(std::string name) {
  std::replace(name.begin(), name.end(), '_', ' ');
  return name;
}

Table errorTable(const std::vector<FlightErrors>& errors) {
  Table table({{"figure", "figure"},
               {"rmse", "RMS error", true, 4},
               {"predicted", "predicted", true, 4},
               {"ratio", "error over predicted", true, 2}});
  for (const FlightFigure& figure : flightFigures()) {
    double error = 0.0, sigma = 0.0;
    int count = 0;
    for (const FlightErrors& e : errors) {
      const ErrorAndSigma& p = e.*figure.member;
      if (!std::isfinite(p.error)) continue;
      error += p.error * p.error;
      sigma += p.sigma * p.sigma;
      ++count;
    }
    if (count == 0) continue;
    table.addRow();
    table.setText("figure", std::string(figure.name) + " [" + figure.unit + "]");
    table.setNumber("rmse", figure.factor * std::sqrt(error / count));
    table.setNumber("predicted", figure.factor * std::sqrt(sigma / count));
    table.setNumber("ratio", std::sqrt(error / sigma));
  }
  return table;
}

Table stageTable(const RunStatistics& statistics) {
  Table table({{"stage", "stage"},
               {"frames", "frames", true},
               {"median", "median [ms]", true, 2},
               {"p99", "99 % [ms]", true, 2},
               {"max", "longest [ms]", true, 1},
               {"total", "total [s]", true, 2}});
  for (const StageTimes& s : statistics.stages) {
    table.addRow();
    table.setText("stage", spaced(s.stage));
    table.setNumber("frames", s.frames);
    table.setNumber("median", s.median_ms);
    table.setNumber("p99", s.p99_ms);
    table.setNumber("max", s.max_ms);
    table.setNumber("total", s.total_s);
  }
  return table;
}

Table eventTable(const RunRecord& record) {
  Table table({{"t", "time [s]", true, 2}, {"state", "state"}, {"reason", "because"}});
  for (const EventRecord& event : record.events) {
    table.addRow();
    table.setNumber("t", secondsBetween(record.first_image, event.t));
    table.setText("state", (event.remark ? "still " : "") + spaced(event.state));
    table.setText("reason", event.reason);
  }
  return table;
}

Table calibrationTable(const RunRecord& record) {
  Table table({{"verdict", "verdict"}, {"words", "of the calibration"}});
  for (const CalibrationRecord& finding : record.calibration) {
    table.addRow();
    table.setText("verdict", spaced(finding.verdict));
    table.setText("words", finding.words);
  }
  return table;
}

Table attemptTable(const RunRecord& record) {
  Table table({{"t", "time [s]", true, 2}, {"status", "status"}, {"reason", "reason"}});
  for (const AttemptRecord& attempt : record.attempts) {
    table.addRow();
    table.setNumber("t", secondsBetween(record.first_image, attempt.t));
    table.setText("status", attempt.status);
    table.setText("reason", attempt.reason);
  }
  return table;
}

std::string summaryOf(const RunRecord& record, const std::string& name, bool has_truth) {
  const RunStatistics& s = record.statistics;
  std::string recording = "<b>" + escaped(name) + "</b> " +
                          counted(static_cast<size_t>(s.stereo_frames), "stereo frame") + ", " +
                          number(s.duration_s) + " s";
  if (!has_truth) recording += ", no ground truth";
  const std::string warnings =
      joined(record.warnings, "<br>", [](const std::string& w) { return escaped(w); });
  const auto ate = [](const char* which, const std::optional<TrajectoryErrors>& errors) {
    return errors ? format("%s %.4f m", which, errors->position_m.rmse) : std::string();
  };
  std::vector<std::string> errors;
  for (const std::string& text :
       {ate("causal", record.trajectory_errors), ate("smoothed", record.smoothed_errors),
        ate("after the final bundle adjustment", record.final_errors)})
    if (!text.empty()) errors.push_back(text);
  const std::string started =
      record.initialized_at ? number(secondsBetween(record.first_image, *record.initialized_at)) +
                                  " s after the first image"
                            : "never";
  return term("Recording", recording) + term("Source", escaped(record.source)) +
         term("Initializer",
              "<b>" + escaped(record.initializer) + "</b> " + escaped(record.initializer_version)) +
         term("Initialized", started) +
         term("ATE in SE(3)", joined(errors, ", ", [](const std::string& t) { return t; })) +
         (warnings.empty() ? "" : term("Warnings", "<span class=\"bad\">" + warnings + "</span>")) +
         term("Versions", versionsText(record.versions));
}

}  // namespace

std::string runReportHtml(const RunRecord& record, const std::vector<FrameEstimate>& estimates,
                          const GroundTruth& ground_truth) {
  const std::string source = record.source.substr(0, record.source.find_last_not_of('/') + 1);
  const std::string name = source.substr(source.rfind('/') + 1);
  const std::vector<FlightErrors> errors = flightErrors(estimates, ground_truth);
  const std::vector<std::pair<std::string, RunRecord>> runs = {{name, record}};
  std::string tables = joined(refusalsOf(runs), "", [](const std::string& sentence) {
    return "<p class=\"bad\">" + escaped(sentence) + "</p>\n";
  });
  tables += section("Errors and what was predicted", errorTable(errors)) +
            section("Events", eventTable(record)) +
            section("Calibration", calibrationTable(record)) +
            section("Time a frame", stageTable(record.statistics)) +
            section("The attempt that counts", compareRuns(runs)) +
            section("All attempts", attemptTable(record));
  return reportPage(report_assets::runPage(), report_assets::runScript(),
                    {{"title", name + ", " + record.initializer},
                     {"summary", summaryOf(record, name, !ground_truth.empty())},
                     {"tables", tables},
                     {"config", escaped(record.config)}},
                    flightData(record, estimates, errors, ground_truth));
}

}  // namespace etalon
