#include "support/print_stage_errors.h"

#include <cmath>
#include <cstdio>
#include <string>

#include "etalon/core/text.h"

namespace etalon::app {

void printStageErrors(const StageRecord& stage) {
  if (!stage.errors) return;
  const WindowErrors& e = *stage.errors;
  std::string text;
  const auto add = [&text](const char* name, double value, int decimals, const char* unit) {
    if (std::isnan(value)) return;  // the ground truth lacks this figure
    text += format("%s%s %.*f %s", text.empty() ? "" : ", ", name, decimals, value, unit);
  };
  add("RRE", e.rre_deg, 4, "deg");
  add("ATE", 1e3 * e.ate_m, 2, "mm");
  add("velocity", e.velocity_mps, 4, "m/s");
  add("gravity", e.gravity_deg, 2, "deg");
  add("b_g", e.gyro_bias_rps, 5, "rad/s");
  add("b_a", e.accel_bias_mps2, 3, "m/s^2");
  const int keyframes = stage.states.size();
  if (text.empty()) text = "errors are not known";
  if (e.keyframes < keyframes)
    text += " (ground truth at " + std::to_string(e.keyframes) + " of " +
            std::to_string(keyframes) + " keyframes)";
  std::printf("  %-6s %s\n", stage.stage.c_str(), text.c_str());
}

}  // namespace etalon::app
