#include "etalon/simulation/faults/fault.h"

namespace etalon {

namespace {

void declareLens(ParameterSet& parameters, Lens* lens) {
  parameters.add("lens", lens,
                 {{"both", Lens::kBoth}, {"left", Lens::kLeft}, {"right", Lens::kRight}},
                 "which camera");
}

}  // namespace

void FaultInterval::declare(ParameterSet& parameters) {
  parameters.add("from", &from_s, {-kUnlimitedS, kUnlimitedS}, "when it begins, s");
  parameters.add("for", &length_s, {0.0, 2.0 * kUnlimitedS}, "how long it lasts, s");
}

namespace faults {

void Covered::declare(ParameterSet& parameters) {
  during.declare(parameters);
  declareLens(parameters, &lens);
}

void Frozen::declare(ParameterSet& parameters) {
  during.declare(parameters);
  declareLens(parameters, &lens);
}

void Dropped::declare(ParameterSet& parameters) { during.declare(parameters); }

void Lost::declare(ParameterSet& parameters) {
  during.declare(parameters);
  parameters.add("percent", &percent, {0.0, 100.0}, "share of the pairs of images");
}

void Every::declare(ParameterSet& parameters) {
  during.declare(parameters);
  parameters.add("n", &n, {1, 1000}, "one pair of n is kept");
}

void ImuGap::declare(ParameterSet& parameters) { during.declare(parameters); }

void Delay::declare(ParameterSet& parameters) {
  during.declare(parameters);
  parameters.add("ms", &ms, {-1000.0, 1000.0}, "stamp less the true instant");
}

void Jitter::declare(ParameterSet& parameters) {
  during.declare(parameters);
  parameters.add("ms", &ms, {0.0, 300.0}, "sigma");
}

void ClockJump::declare(ParameterSet& parameters) {
  constexpr double kDayS = 86400.0;
  parameters.add("from", &from_s, {-FaultInterval::kUnlimitedS, FaultInterval::kUnlimitedS},
                 "when it happens, s");
  parameters.add("by", &by_s, {0.0, kDayS}, "how far, s");
}

void Exposure::declare(ParameterSet& parameters) {
  during.declare(parameters);
  declareLens(parameters, &lens);
  parameters.add("factor", &factor, {0.0, 100.0}, "on the grey levels");
  parameters.add("offset", &offset, {-255.0, 255.0}, "grey levels");
}

void Blur::declare(ParameterSet& parameters) {
  during.declare(parameters);
  declareLens(parameters, &lens);
  parameters.add("px", &sigma_px, {0.0, 50.0}, "sigma");
}

void MotionBlur::declare(ParameterSet& parameters) {
  during.declare(parameters);
  declareLens(parameters, &lens);
  parameters.add("px", &length_px, {0.0, 100.0}, "length");
  parameters.add("direction_deg", &direction_deg, {-180.0, 180.0}, "from right to down");
}

void ImageNoise::declare(ParameterSet& parameters) {
  during.declare(parameters);
  declareLens(parameters, &lens);
  parameters.add("gray", &sigma_gray, {0.0, 255.0}, "sigma, grey levels");
}

void ImuLimit::declare(ParameterSet& parameters) {
  during.declare(parameters);
  parameters.add("gyro_dps", &gyro_dps, {0.0, 1e9}, "deg/s");
  parameters.add("accel_mps2", &accel_mps2, {0.0, 1e9}, "m/s^2");
}

void BiasJump::declare(ParameterSet& parameters) {
  during.declare(parameters);
  parameters.add("gyro_dps", &gyro_dps, {0.0, 1000.0}, "deg/s");
  parameters.add("accel_mps2", &accel_mps2, {0.0, 100.0}, "m/s^2");
}

void WrongCalibration::declare(ParameterSet& parameters) {
  declareLens(parameters, &lens);
  parameters.add("rotation_deg", &rotation_deg, {0.0, 180.0}, "turn of the camera");
  parameters.add("focal_percent", &focal_percent, {-50.0, 100.0}, "too long");
  parameters.add("baseline_percent", &baseline_percent, {-99.0, 1000.0}, "too long");
}

}  // namespace faults

}  // namespace etalon
