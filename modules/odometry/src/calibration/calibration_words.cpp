#include <algorithm>
#include <cmath>

#include "calibration_watch.h"
#include "etalon/core/text.h"

namespace etalon {

void CalibrationOptions::declare(ParameterSet& parameters) {
  const std::vector<std::pair<std::string, CalibrationMode>> modes = {
      {"off", CalibrationMode::kOff},
      {"on", CalibrationMode::kOn},
      {"auto", CalibrationMode::kAuto}};
  parameters.add("calibrate_time_offset", &time_offset, modes,
                 "The time offset between cameras and IMU: taken as given (off), followed as "
                 "estimated (on), or estimated and used only where what was given is certainly "
                 "wrong (auto).");
  parameters.add("calibrate_extrinsics", &extrinsics, modes,
                 "The same of the poses of the cameras, in the body and to each other.");
  parameters.add("calibrate_intrinsics", &intrinsics, modes,
                 "The same of focal lengths, principal points and radial distortion.");
  parameters.add("accel_scale_sigma", &accel_scale_sigma, {0.0, 1.0},
                 "Standard deviation of the accelerometer's scale factor, relative: the length of "
                 "the baseline is measured with it. 0: it is exact.");
  parameters.add(
      "gyro_scale_sigma", &gyro_scale_sigma, {0.0, 1.0},
      "The same of the gyro, by which the focal lengths are measured: most data sheets say "
      "1 to 3 %, a calibrated IMU is good to 0.1 % or less.");
}

const char* toString(CalibrationFinding::Verdict verdict) {
  switch (verdict) {
    case CalibrationFinding::Verdict::kNotObserved:
      return "not_observed";
    case CalibrationFinding::Verdict::kAgrees:
      return "agrees";
    case CalibrationFinding::Verdict::kOff:
      return "off";
    case CalibrationFinding::Verdict::kImplausible:
      return "implausible";
  }
  return "";
}

namespace fixed_lag {

/** With as many decimals as the smallest sigma has: two of its digits. */
static std::string numbers(const Eigen::VectorXd& values, int decimals, const char* sign) {
  std::string text;
  const std::string number = std::string("%") + sign + ".*f";
  for (Eigen::Index i = 0; i < values.size(); ++i) {
    text += (i > 0 ? ", " : "") + format(number.c_str(), decimals, values[i]);
  }
  return values.size() > 1 ? "(" + text + ")" : text;
}

std::string inWords(const CalibrationFinding& finding, const CalibrationQuantity& quantity,
                    bool settled) {
  using Verdict = CalibrationFinding::Verdict;
  const std::string name = finding.quantity + ": ";
  if (!settled) return name + "not judged, because the odometry had not settled";
  const double least = std::max(1e-6, finding.sigma.minCoeff());
  const int decimals = std::clamp(1 - static_cast<int>(std::floor(std::log10(least))), 0, 6);
  const std::string sigma = "+- " + numbers(finding.sigma, decimals, "");
  const std::string value =
      numbers(finding.value, decimals, "+") + " " + finding.unit + " " + sigma;
  const bool used = !finding.used.isZero(0.0);
  switch (finding.verdict) {
    case Verdict::kNotObserved:
      return name + "not observed, because the motion hardly tells it, " + sigma + " " +
             finding.unit + (used ? "; the estimate is used" : "");
    case Verdict::kAgrees:
      if (!used && (finding.value.array().abs() > kDoubtful * finding.sigma.array()).any())
        return name + "perhaps off by " + value + ", which is not certain enough; left as given";
      return name + "agrees with what was given, " + value + (used ? "; the estimate is used" : "");
    case Verdict::kImplausible:
      return name + "off by " + value + ", farther than a calibration can be; not corrected";
    case Verdict::kOff:
      break;
  }
  const char* meaning = finding.value[0] > 0.0 ? quantity.plus : quantity.minus;
  return name + "off by " + value + (meaning ? std::string(" (") + meaning + ")" : "") +
         (used ? "; corrected" : "; not corrected yet");
}

}  // namespace fixed_lag
}  // namespace etalon
