#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <memory>
#include <string>
#include <vector>

#include "commands.h"
#include "etalon/benchmark/sequence_tracks.h"
#include "etalon/core/angles.h"
#include "etalon/core/errors.h"
#include "etalon/core/output_file.h"
#include "etalon/core/text.h"
#include "etalon/datasets/recorded_source.h"
#include "etalon/ground_truth/smoothing.h"
#include "etalon/report/plot.h"
#include "options/ground_truth_option.h"
#include "options/recording_option.h"

namespace etalon::app {

namespace {

struct GroundTruthArguments {
  std::vector<std::string> sources;
  std::string out;
  GroundTruthOption recorded;
};

/** What a recording's ground truth has wrong. */
struct Judged {
  std::string name;
  GroundTruthSmoothing found;
};

/** An offset this many standard errors large is there. */
constexpr double kSignificant = 2.5;

bool significant(const Measured& m) { return std::abs(m.value) > kSignificant * m.sigma; }

std::string number(const Measured& m, double unit, int decimals) {
  return format("%.*f +- %.*f", decimals, unit * m.value, decimals, unit * m.sigma);
}

std::string vector(const Measured3& m, double unit, int decimals) {
  return format("%.*f %.*f %.*f +- %.*f", decimals, unit * m.value[0], decimals, unit * m.value[1],
                decimals, unit * m.value[2], decimals, unit * m.sigma.maxCoeff());
}

/** What is significant, in words. */
std::string words(const GroundTruthSmoothing& found) {
  std::string text;
  const auto say = [&text](const std::string& clause) {
    text += (text.empty() ? "" : ", ") + clause;
  };
  const auto shifted = [&](const char* what, const Measured& shift) {
    if (significant(shift))
      say(format("%s %s ms %s", what, number({std::abs(shift.value), shift.sigma}, 1e3, 1).c_str(),
                 shift.value < 0.0 ? "late" : "early"));
  };
  shifted("positions", found.offset.position_shift_s);
  if (!text.empty() && std::isfinite(found.position_bandwidth_hz.value))
    text += format(" below %.1f Hz (as one number %s)", found.position_bandwidth_hz.value,
                   number({std::abs(found.plain_offset.position_shift_s.value),
                           found.plain_offset.position_shift_s.sigma},
                          1e3, 1)
                       .c_str());
  shifted("rotations", found.offset.rotation_shift_s);
  for (int i = 0; i < 3; ++i) {
    const Measured turn{found.offset.turn_rad.value[i], found.offset.turn_rad.sigma[i]};
    if (!significant(turn)) continue;
    say(format("turned %s deg about %c", number(turn, kDegreesPerRadian, 2).c_str(), 'x' + i));
    if (std::isfinite(found.rotation_bandwidth_hz.value))
      text += format(" below %.1f Hz (as one number %.2f)", found.rotation_bandwidth_hz.value,
                     degrees(found.plain_offset.turn_rad.value[i]));
  }
  if (significant(found.tilt_rad))
    say("tilted " + number(found.tilt_rad, kDegreesPerRadian, 2) + " deg");
  if (!found.gaps.empty()) say(format("%zu gaps", found.gaps.size()));
  return text.empty() ? "nothing significant" : text;
}

std::string bandwidth(const Measured& m) {
  return std::isinf(m.value) ? "all" : number(m, 1.0, 2) + " Hz";
}

/** All that was found, a line each. */
std::string details(const Judged& judged) {
  const GroundTruthSmoothing& f = judged.found;
  std::string text = "# " + judged.name + "\n\n" + words(f) + "\n\n";
  const auto line = [&text](const std::string& what, const std::string& value) {
    text += "| " + what + " | " + value + " |\n";
  };
  text += "| | in slow motion (of the tracker) |\n|---|---|\n";
  const auto offset = [&](const BodyOffset& o) {
    line("shift of positions, ms", number(o.position_shift_s, 1e3, 2));
    line("shift of rotations, ms", number(o.rotation_shift_s, 1e3, 3));
    line("one shift for both, ms",
         number(o.common_shift_s, 1e3, 3) +
             format("; the two differ by %.1f standard errors", o.shifts_differ_sigmas));
    line("body turned about x, y, z, deg", vector(o.turn_rad, kDegreesPerRadian, 3));
    line("lever arm x, y, z, mm", vector(o.lever_m, 1e3, 1));
  };
  offset(f.offset);
  line("positions follow the tracker up to", bandwidth(f.position_bandwidth_hz));
  line("rotations follow the tracker up to", bandwidth(f.rotation_bandwidth_hz));
  line("world tilted, deg", number(f.tilt_rad, kDegreesPerRadian, 3));
  line("gravity, m/s^2", format("%.4f", f.gravity_mps2));
  line("error of positions, white, mm", number(f.position_error.white, 1e3, 2));
  line("error of positions, correlated, mm", number(f.position_error.correlated, 1e3, 2));
  line("its correlation time, s", number(f.position_error.correlation_time_s, 1.0, 2));
  line("error of rotations, white, deg", number(f.rotation_error.white, kDegreesPerRadian, 4));
  line("error of rotations, correlated, deg",
       number(f.rotation_error.correlated, kDegreesPerRadian, 4));
  line("its correlation time, s", number(f.rotation_error.correlation_time_s, 1.0, 2));
  line("gyro's noise and walk, data sheets",
       number(f.imu.gyro_noise, 1.0, 2) + ", " + number(f.imu.gyro_walk, 1.0, 2));
  line("accelerometer's noise and walk, data sheets",
       number(f.imu.accel_noise, 1.0, 2) + ", " + number(f.imu.accel_walk, 1.0, 2));
  line("rows, believed, seconds, blocks",
       format("%zu, %zu, %.1f, %d", f.rows, f.believed, f.length_s, f.blocks));
  for (const GroundTruthGap& gap : f.gaps)
    line(format("gap after %lld", static_cast<long long>(gap.after)),
         format("%.3f s", gap.length_s));
  text += "\nThe same as one number for all frequencies:\n\n| | |\n|---|---|\n";
  offset(f.plain_offset);
  text += "\n![corrected against recorded](difference.svg)\n";
  return text;
}

std::string csvOf(const GroundTruth& truth) {
  std::string text =
      "#timestamp, p_RS_R_x [m], p_RS_R_y [m], p_RS_R_z [m], q_RS_w [], q_RS_x [], q_RS_y [], "
      "q_RS_z [], v_RS_R_x [m s^-1], v_RS_R_y [m s^-1], v_RS_R_z [m s^-1], b_w_RS_S_x [rad s^-1], "
      "b_w_RS_S_y [rad s^-1], b_w_RS_S_z [rad s^-1], b_a_RS_S_x [m s^-2], b_a_RS_S_y [m s^-2], "
      "b_a_RS_S_z [m s^-2]\n";
  for (const StampedState& s : truth.states) {
    const Eigen::Quaterniond q(s.T_WB.R);
    text += format("%lld,%.9f,%.9f,%.9f,%.9f,%.9f,%.9f,%.9f,%.9f,%.9f,%.9f",
                   static_cast<long long>(s.t), s.T_WB.t.x(), s.T_WB.t.y(), s.T_WB.t.z(), q.w(),
                   q.x(), q.y(), q.z(), s.v_WB.x(), s.v_WB.y(), s.v_WB.z());
    for (const Eigen::Vector3d& bias : {s.bias.gyro, s.bias.accel})
      text += format(",%.9f,%.9f,%.9f", bias.x(), bias.y(), bias.z());
    text += "\n";
  }
  return text;
}

Judged judge(const std::string& source, const GroundTruthArguments& arguments) {
  SourceOptions options;
  options.ground_truth = arguments.recorded.of(source);
  const auto recording = openRecording(source, options);
  const GroundTruth& recorded = recording->groundTruth();
  if (recorded.empty()) throw DataError(source, 0, "has no ground truth");
  auto found =
      smoothGroundTruth(recorded, recording->imuSamples(), recording->calibration().imu.noise);
  if (!found) throw DataError(source, 0, "ground truth: " + found.error().reason);

  Judged judged{recordingName(source), std::move(*found)};
  const std::string folder = arguments.out + "/" + judged.name;
  makeFolder(folder);
  Trajectory poses;
  for (const StampedState& state : judged.found.corrected.states)
    poses.push_back({state.t, state.T_WB});
  writeFile(folder + "/data.csv", csvOf(judged.found.corrected));
  writeTum(folder + "/corrected.tum", poses);
  writeFile(folder + "/report.md", details(judged));
  TrajectoryPlotOptions plot;
  plot.title = judged.name + ": corrected against recorded";
  plot.alignment = AlignmentType::kSE3;
  drawTrajectoryPlot(folder + "/difference.svg", poses, recorded, plot);
  return judged;
}

void print(const std::vector<Judged>& all) {
  std::printf("%-16s %-14s %-14s %-14s %-25s %-12s\n", "recording", "positions, ms",
              "as one number", "rotations, ms", "turned x y z, deg", "tilted, deg");
  for (const Judged& one : all) {
    const GroundTruthSmoothing& f = one.found;
    std::printf("%-16s %-14s %-14s %-14s %-25s %-12s\n", one.name.substr(0, 16).c_str(),
                number(f.offset.position_shift_s, 1e3, 1).c_str(),
                number(f.plain_offset.position_shift_s, 1e3, 1).c_str(),
                number(f.offset.rotation_shift_s, 1e3, 2).c_str(),
                vector(f.offset.turn_rad, kDegreesPerRadian, 2).c_str(),
                number(f.tilt_rad, kDegreesPerRadian, 2).c_str());
  }
  std::printf("%-16s %-24s %-16s %-12s %-14s %-8s\n", "", "lever x y z, mm", "positions follow",
              "error, mm", "error, deg", "gaps");
  for (const Judged& one : all) {
    const GroundTruthSmoothing& f = one.found;
    std::printf("%-16s %-24s %-16s %-12s %-14s %-8zu\n", one.name.substr(0, 16).c_str(),
                vector(f.offset.lever_m, 1e3, 0).c_str(),
                bandwidth(f.position_bandwidth_hz).c_str(),
                number(f.position_error.correlated, 1e3, 1).c_str(),
                number(f.rotation_error.correlated, kDegreesPerRadian, 3).c_str(), f.gaps.size());
  }
  for (const Judged& one : all) std::printf("%s: %s\n", one.name.c_str(), words(one.found).c_str());
}

}  // namespace

void addGroundTruthCommand(CLI::App& app, int* exit_code) {
  auto arguments = std::make_shared<GroundTruthArguments>();
  CLI::App* command = app.add_subcommand(
      "ground-truth", "Smooth a recorded ground truth with the IMU and say what is wrong with it.");
  command->add_option("SRC", arguments->sources, kSourceFormats)->required();
  command->add_option("--out", arguments->out, "Folder for the corrected ones and the reports")
      ->required();
  arguments->recorded.add(command);
  command->footer(
      "Writes NAME/{data.csv, corrected.tum, report.md, difference.svg} into the folder.\n"
      "Exit codes: 0 done, 2 usage, 3 data.");
  command->callback([arguments, exit_code] {
    arguments->recorded.check(arguments->sources);
    std::vector<Judged> all;
    for (const std::string& source : arguments->sources) all.push_back(judge(source, *arguments));
    print(all);
    *exit_code = kOk;
  });
}

}  // namespace etalon::app
