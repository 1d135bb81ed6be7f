#include "etalon/report/ground_truth_report.h"

#include <algorithm>
#include <cmath>

#include "etalon/core/angles.h"
#include "etalon/core/text.h"
#include "etalon/report/plot.h"
#include "report_page.h"

namespace etalon {
namespace {

constexpr int kScreenWidth = 100;
constexpr size_t kNameWidth = 16;  // in the tables, which are as wide as the page with it

/** An offset this many standard errors large is there. */
constexpr double kSignificant = 2.5;

bool significant(const Measured& m) { return std::abs(m.value) > kSignificant * m.sigma; }

std::string measured(const Measured& m, double unit, int decimals) {
  return format("%.*f +- %.*f", decimals, unit * m.value, decimals, unit * m.sigma);
}

std::string measured(const Measured3& m, double unit, int decimals) {
  return format("%.*f %.*f %.*f +- %.*f", decimals, unit * m.value[0], decimals, unit * m.value[1],
                decimals, unit * m.value[2], decimals, unit * m.sigma.maxCoeff());
}

std::string bandwidth(const Measured& m) {
  return std::isinf(m.value) ? "all" : measured(m, 1.0, 2);
}

Table::Column column(const std::string& key, const std::string& title) {
  Table::Column column;
  column.key = key;
  column.title = title;
  return column;
}

/** A text in lines of kScreenWidth, those after the first indented. */
std::string wrapped(const std::string& text) {
  std::string result, line;
  size_t begin = 0;
  while (begin < text.size()) {
    const size_t end = std::min(text.find(' ', begin), text.size());
    const std::string word = text.substr(begin, end - begin);
    if (!line.empty() && displayWidth(line) + 1 + displayWidth(word) > kScreenWidth) {
      result += line + "\n";
      line = "   ";
    }
    line += (line.empty() ? "" : " ") + word;
    begin = end + 1;
  }
  return result + line + "\n";
}

Table offsetsTable(const std::vector<GroundTruthJudgement>& all) {
  Table table({column("recording", "recording"), column("positions", "positions, ms"),
               column("positions_hz", "up to, Hz"), column("rotations", "rotations, ms"),
               column("turned", "turned x y z, deg"), column("gaps", "gaps")});
  for (const GroundTruthJudgement& one : all) {
    const GroundTruthSmoothing& f = one.found;
    table.addRow();
    table.setText("recording", one.name.substr(0, kNameWidth));
    table.setText("positions", measured(f.offset.position_shift_s, 1e3, 1));
    table.setText("positions_hz", bandwidth(f.position_bandwidth_hz));
    table.setText("rotations", measured(f.offset.rotation_shift_s, 1e3, 2));
    table.setText("turned", measured(f.offset.turn_rad, kDegreesPerRadian, 2));
    table.setText("gaps", std::to_string(f.gaps.size()));
  }
  return table;
}

Table errorsTable(const std::vector<GroundTruthJudgement>& all) {
  Table table({column("recording", "recording"), column("rotations_hz", "turn up to, Hz"),
               column("tilted", "tilted, deg"), column("lever", "lever x y z, mm"),
               column("position", "error, mm"), column("rotation", "error, deg")});
  for (const GroundTruthJudgement& one : all) {
    const GroundTruthSmoothing& f = one.found;
    table.addRow();
    table.setText("recording", one.name.substr(0, kNameWidth));
    table.setText("rotations_hz", bandwidth(f.rotation_bandwidth_hz));
    table.setText("tilted", measured(f.tilt_rad, kDegreesPerRadian, 2));
    table.setText("lever", measured(f.offset.lever_m, 1e3, 0));
    table.setText("position", measured(f.position_error.correlated, 1e3, 1));
    table.setText("rotation", measured(f.rotation_error.correlated, kDegreesPerRadian, 3));
  }
  return table;
}

std::string visionInWords(const VisionCheck& vision) {
  const bool supported = 2 * vision.corrected_is_nearer >= vision.windows;
  return format(
             "stereo odometry over 2.25 s is off by %.2f mm from the recorded positions, by %.2f "
             "mm from the corrected ones (medians of %zu windows; the corrected are nearer in %zu)",
             1e3 * vision.recorded_m, 1e3 * vision.corrected_m, vision.windows,
             vision.corrected_is_nearer) +
         (supported ? "" : ": the images do not support the correction, keep the recorded ones");
}

/** Rows of a table of two columns. */
class Rows {
 public:
  void add(const std::string& what, const std::string& value) {
    html_ += "<tr><th>" + escaped(what) + "</th><td>" + escaped(value) + "</td></tr>\n";
  }
  void addOffset(const BodyOffset& o) {
    add("shift of positions, ms", measured(o.position_shift_s, 1e3, 2));
    add("shift of rotations, ms", measured(o.rotation_shift_s, 1e3, 3));
    add("one shift for both, ms",
        measured(o.common_shift_s, 1e3, 3) +
            format("; the two differ by %.1f standard errors", o.shifts_differ_sigmas));
    add("body turned about x, y, z, deg", measured(o.turn_rad, kDegreesPerRadian, 3));
    add("lever arm x, y, z, mm", measured(o.lever_m, 1e3, 1));
  }
  void addError(const std::string& of, const ErrorModel& e, double unit, int decimals) {
    add("error of " + of + ", white", measured(e.white, unit, decimals));
    add("error of " + of + ", correlated", measured(e.correlated, unit, decimals));
    add("its correlation time, s", measured(e.correlation_time_s, 1.0, 2));
  }
  /** Under a heading. */
  std::string html(const std::string& heading) const {
    return "<h2>" + escaped(heading) + "</h2>\n<table>\n" + html_ + "</table>\n";
  }

 private:
  std::string html_;
};

std::string tablesHtml(const GroundTruthSmoothing& f) {
  Rows slow, plain, rest;
  slow.addOffset(f.offset);
  slow.add("positions follow the tracker up to, Hz", bandwidth(f.position_bandwidth_hz));
  slow.add("rotations follow the tracker up to, Hz", bandwidth(f.rotation_bandwidth_hz));
  plain.addOffset(f.plain_offset);
  rest.add("world tilted, deg", measured(f.tilt_rad, kDegreesPerRadian, 3));
  rest.add("gravity, m/s^2", format("%.4f", f.gravity_mps2));
  rest.addError("positions, mm", f.position_error, 1e3, 2);
  rest.addError("rotations, deg", f.rotation_error, kDegreesPerRadian, 4);
  rest.add("gyro's noise and walk, data sheets",
           measured(f.imu.gyro_noise, 1.0, 2) + ", " + measured(f.imu.gyro_walk, 1.0, 2));
  rest.add("accelerometer's noise and walk, data sheets",
           measured(f.imu.accel_noise, 1.0, 2) + ", " + measured(f.imu.accel_walk, 1.0, 2));
  rest.add("rows, believed, seconds, blocks",
           format("%zu, %zu, %.1f, %d", f.rows, f.believed, f.length_s, f.blocks));
  for (const GroundTruthGap& gap : f.gaps)
    rest.add(format("gap after %lld", static_cast<long long>(gap.after)),
             format("%.3f s", gap.length_s));
  return slow.html("In slow motion: of the tracker") +
         plain.html("The same as one number for all motion") + rest.html("World and errors");
}

}  // namespace

std::string inWords(const GroundTruthSmoothing& found) {
  std::string text;
  const auto say = [&text](const std::string& clause) {
    text += (text.empty() ? "" : ", ") + clause;
  };
  const auto shifted = [&](const char* what, const Measured& shift) {
    if (significant(shift))
      say(format("%s %s ms %s", what,
                 measured({std::abs(shift.value), shift.sigma}, 1e3, 1).c_str(),
                 shift.value < 0.0 ? "late" : "early"));
  };
  shifted("positions", found.offset.position_shift_s);
  if (!text.empty() && std::isfinite(found.position_bandwidth_hz.value))
    text += format(" below %.1f Hz (as one number %s)", found.position_bandwidth_hz.value,
                   measured({std::abs(found.plain_offset.position_shift_s.value),
                             found.plain_offset.position_shift_s.sigma},
                            1e3, 1)
                       .c_str());
  shifted("rotations", found.offset.rotation_shift_s);
  for (int i = 0; i < 3; ++i) {
    const Measured turn{found.offset.turn_rad.value[i], found.offset.turn_rad.sigma[i]};
    if (!significant(turn)) continue;
    say(format("turned %s deg about %c", measured(turn, kDegreesPerRadian, 2).c_str(), 'x' + i));
    if (std::isfinite(found.rotation_bandwidth_hz.value))
      text += format(" below %.1f Hz (as one number %.2f)", found.rotation_bandwidth_hz.value,
                     degrees(found.plain_offset.turn_rad.value[i]));
  }
  if (significant(found.tilt_rad))
    say("tilted " + measured(found.tilt_rad, kDegreesPerRadian, 2) + " deg");
  if (!found.gaps.empty()) say(format("%zu gaps", found.gaps.size()));
  return text.empty() ? "nothing significant" : text;
}

std::string groundTruthPage(const std::vector<GroundTruthJudgement>& all) {
  std::string page = offsetsTable(all).toString(TableFormat::kText) + "\n" +
                     errorsTable(all).toString(TableFormat::kText) + "\n";
  for (const GroundTruthJudgement& one : all) {
    page += wrapped(one.name + ": " + inWords(one.found));
    if (one.vision.windows > 0)
      page += wrapped(one.name + ", images: " + visionInWords(one.vision));
  }
  return page;
}

std::string groundTruthReportHtml(const GroundTruthJudgement& judgement,
                                  const GroundTruth& recorded) {
  Trajectory poses;
  for (const StampedState& state : judgement.found.corrected.states)
    poses.push_back({state.t, state.T_WB});
  TrajectoryPlotOptions plot;
  plot.title = judgement.name + ": corrected against recorded";
  plot.alignment = AlignmentType::kSE3;
  plot.estimate_name = "corrected";
  plot.truth_name = "recorded";
  const std::string title = escaped("Ground truth of " + judgement.name);
  std::string page =
      "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n<title>" + title +
      "</title>\n<style>body{font-family:sans-serif;max-width:70em;margin:1em auto;padding:0 1em}"
      "th{text-align:left;font-weight:normal;padding-right:2em}svg{width:100%;height:auto}"
      "h2{font-size:1.1em}</style>\n</head>\n<body>\n<h1>" +
      title + "</h1>\n<p>" + escaped(inWords(judgement.found)) + "</p>\n";
  if (judgement.vision.windows > 0)
    page += "<p>Images: " + escaped(visionInWords(judgement.vision)) + "</p>\n";
  return page + trajectoryPlotSvg(poses, recorded, plot) + tablesHtml(judgement.found) +
         "</body>\n</html>\n";
}

}  // namespace etalon
