#include "etalon/core/trajectory.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <sstream>

#include "etalon/core/errors.h"
#include "etalon/core/output_file.h"
#include "etalon/core/printable.h"
#include "etalon/core/so3.h"

namespace etalon {

std::optional<StampedState> GroundTruth::at(TimeNs t, double max_gap_s) const {
  const auto after = std::lower_bound(states.begin(), states.end(), t,
                                      [](const StampedState& s, TimeNs v) { return s.t < v; });
  if (after == states.end()) return std::nullopt;
  if (after->t == t) return *after;
  if (after == states.begin()) return std::nullopt;
  const StampedState& a = *(after - 1);
  const StampedState& b = *after;
  const double dt = secondsBetween(a.t, b.t);
  if (dt > max_gap_s) return std::nullopt;
  const double u = secondsBetween(a.t, t) / dt;

  StampedState s;
  s.t = t;
  s.T_WB.R = a.T_WB.R * expSO3(u * logSO3(a.T_WB.R.transpose() * b.T_WB.R));
  if (has_velocity) {
    const double u2 = u * u, u3 = u2 * u;
    s.T_WB.t = (2 * u3 - 3 * u2 + 1) * a.T_WB.t + (u3 - 2 * u2 + u) * dt * a.v_WB +
               (3 * u2 - 2 * u3) * b.T_WB.t + (u3 - u2) * dt * b.v_WB;
  } else {
    s.T_WB.t = a.T_WB.t + u * (b.T_WB.t - a.T_WB.t);
  }
  s.v_WB = a.v_WB + u * (b.v_WB - a.v_WB);
  s.bias.gyro = a.bias.gyro + u * (b.bias.gyro - a.bias.gyro);
  s.bias.accel = a.bias.accel + u * (b.bias.accel - a.bias.accel);
  return s;
}

Trajectory carriedAlong(const Trajectory& trajectory, const Trajectory& better) {
  // An improved pose and its index in the trajectory.
  struct Anchor {
    size_t index;
    const SE3* T_WB;
  };
  std::vector<Anchor> anchors;
  size_t i = 0;
  for (const StampedPose& pose : better) {
    while (i < trajectory.size() && trajectory[i].t < pose.t) ++i;
    if (i < trajectory.size() && trajectory[i].t == pose.t) anchors.push_back({i, &pose.T_WB});
  }
  Trajectory carried = trajectory;
  if (anchors.empty()) return carried;
  const auto from = [&trajectory](const Anchor& anchor, size_t k) {
    return *anchor.T_WB * (trajectory[anchor.index].T_WB.inverse() * trajectory[k].T_WB);
  };
  size_t next = 0;  // the first anchor at or after k
  for (size_t k = 0; k < carried.size(); ++k) {
    while (next < anchors.size() && anchors[next].index < k) ++next;
    SE3& T_WB = carried[k].T_WB;
    T_WB = from(anchors[next == anchors.size() ? next - 1 : next], k);
    if (next == 0 || next == anchors.size()) continue;
    const Anchor& before = anchors[next - 1];
    const SE3 T_before = from(before, k);
    const double u = secondsBetween(trajectory[before.index].t, trajectory[k].t) /
                     secondsBetween(trajectory[before.index].t, trajectory[anchors[next].index].t);
    T_WB.R = T_before.R * expSO3(u * logSO3(T_before.R.transpose() * T_WB.R));
    T_WB.t = T_before.t + u * (T_WB.t - T_before.t);
  }
  return carried;
}

void writeTum(const std::string& path, const Trajectory& trajectory, const std::string& frames) {
  OutputFile file(path);
  file.stream() << "# " << frames << ": timestamp[s] x y z[m] qx qy qz qw\n";
  std::vector<char> row(3000);  // nine numbers of at most 309 digits before the point
  for (const StampedPose& pose : trajectory) {
    const Eigen::Quaterniond q = Eigen::Quaterniond(pose.T_WB.R).normalized();
    const Eigen::Vector3d& p = pose.T_WB.t;
    const char* const sign = pose.t < 0 ? "-" : "";
    std::snprintf(row.data(), row.size(), "%s%lld.%09lld %.9f %.9f %.9f %.9f %.9f %.9f %.9f\n",
                  sign, std::llabs(pose.t / kNanosecondsPerSecond),
                  std::llabs(pose.t % kNanosecondsPerSecond), p.x(), p.y(), p.z(), q.x(), q.y(),
                  q.z(), q.w());
    file.stream() << row.data();
  }
  if (!file.stream()) file.fail();
  file.putInPlace();
}

/** Decimal seconds to nanoseconds without passing through a double. */
static bool parseSeconds(const std::string& text, TimeNs* t) {
  constexpr TimeNs kMaxSeconds = 9'000'000'000;  // fits into TimeNs
  const size_t dot = text.find('.');
  const std::string whole = text.substr(0, dot);
  std::string fraction = dot == std::string::npos ? "" : text.substr(dot + 1);
  if (text.find_first_of("eE") != std::string::npos) {  // e.g. numpy's 1.403636e+09
    char* end = nullptr;
    const long double value = std::strtold(text.c_str(), &end);
    if (*end != '\0' || !(value >= 0.0L && value < kMaxSeconds)) return false;
    *t = static_cast<TimeNs>(std::llroundl(value * 1e9L));
    return true;
  }
  if (whole.empty() || whole.size() > 10) return false;
  if (whole.find_first_not_of("0123456789") != std::string::npos ||
      fraction.find_first_not_of("0123456789") != std::string::npos)
    return false;
  fraction.resize(9, '0');
  const long long seconds = std::stoll(whole);
  if (seconds >= kMaxSeconds) return false;
  *t = seconds * kNanosecondsPerSecond + std::stoll(fraction);
  return true;
}

Trajectory readTum(const std::string& path) {
  std::error_code ignored;
  if (std::filesystem::is_directory(path, ignored))
    throw DataError(path, 0, "is a folder; expected a TUM trajectory (t x y z qx qy qz qw)");
  std::ifstream in(path);
  if (!in)
    throw DataError(path, 0, "cannot be opened; expected a TUM trajectory (t x y z qx qy qz qw)");
  Trajectory trajectory;
  std::string line;
  for (int number = 1; std::getline(in, line); ++number) {
    if (number == 1) line = withoutByteOrderMark(line);
    const size_t first = line.find_first_not_of(" \t\r");
    if (first == std::string::npos || line[first] == '#') continue;
    std::istringstream words(line);
    std::string stamp;
    Eigen::Vector3d p;
    Eigen::Quaterniond q;
    StampedPose pose;
    words >> stamp >> p.x() >> p.y() >> p.z() >> q.x() >> q.y() >> q.z() >> q.w();
    std::string rest;
    if (words.fail() || (words >> rest))
      throw DataError(path, number,
                      std::string("expected 8 numbers: t[s] x y z qx qy qz qw") +
                          (line.find(',') == std::string::npos ? "" : ", with blanks, not commas"));
    if (!parseSeconds(stamp, &pose.t))
      throw DataError(path, number,
                      "expected a stamp in seconds, from 0 to 9e9, found '" + printable(stamp) +
                          "'" + (stamp.size() >= 18 ? "; is it in nanoseconds?" : ""));
    if (!p.allFinite() || std::abs(q.norm() - 1.0) > 1e-2)
      throw DataError(path, number, "expected a finite position and a unit quaternion");
    if (!trajectory.empty() && pose.t <= trajectory.back().t)
      throw DataError(path, number, "expected strictly increasing stamps");
    pose.T_WB = SE3(q.normalized().toRotationMatrix(), p);
    trajectory.push_back(pose);
  }
  if (in.bad()) throw DataError(path, 0, "cannot be read; expected a TUM trajectory");
  return trajectory;
}

}  // namespace etalon
