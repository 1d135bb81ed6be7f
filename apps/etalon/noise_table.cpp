#include "noise_table.h"

#include <cstdio>

namespace etalon::app {

namespace {

void setFactors(const NoiseFactors& factors, Table* table) {
  table->setNumber("gyro_noise_factor", factors.gyro);
  table->setNumber("accel_noise_factor", factors.accel);
  table->setNumber("sigma_px", factors.sigma_px);
}

}  // namespace

Table emptyNoiseTable() {
  return Table({{"recording", "recording"},
                {"interval", "interval [s]", true, 2},
                {"iteration", "iteration"},
                {"windows", "windows used", true},
                {"offered", "of", true},
                {"at_rest", "at rest", true},
                {"failed", "failed", true},
                {"gyro_noise_factor", "gyro factor", true, 2},
                {"gyro_sigma", "+- [%]", true, 0, 100.0},
                {"accel_noise_factor", "accel. factor", true, 2},
                {"accel_sigma", "+- [%]", true, 0, 100.0},
                {"sigma_px", "sigma_px", true, 3},
                {"sigma_px_sigma", "+- [%]", true, 1, 100.0},
                {"chi2_gyro", "chi2/dof gyro", true, 2},
                {"chi2_accel", "accel.", true, 2},
                {"chi2_vision", "vision", true, 2}});
}

void addNoiseRows(const std::string& recording, double interval_s,
                  const NoiseCalibration& calibration, Table* table) {
  for (size_t i = 0; i < calibration.iterations.size(); ++i) {
    const NoiseIteration& iteration = calibration.iterations[i];
    table->addRow();
    table->setText("recording", recording);
    table->setNumber("interval", interval_s);
    table->setText("iteration", std::to_string(i + 1));
    table->setNumber("windows", iteration.windows);
    setFactors(iteration.believed, table);
    const NoiseCheck& c = iteration.check;
    table->setNumber("chi2_gyro", c.gyro.chi2 / c.gyro.dof);
    table->setNumber("chi2_accel", c.accel.chi2 / c.accel.dof);
    table->setNumber("chi2_vision", c.vision.chi2 / c.vision.dof);
  }
  table->addRow();
  table->setText("recording", recording);
  table->setNumber("interval", interval_s);
  table->setText("iteration", calibration.converged ? "result" : "not converged");
  if (!calibration.iterations.empty())
    table->setNumber("windows", calibration.iterations.back().windows);
  table->setNumber("offered", calibration.windows);
  table->setNumber("at_rest", calibration.at_rest);
  table->setNumber("failed", calibration.failed);
  setFactors(calibration.factors, table);
  table->setNumber("gyro_sigma", calibration.relative_sigma.gyro);
  table->setNumber("accel_sigma", calibration.relative_sigma.accel);
  table->setNumber("sigma_px_sigma", calibration.relative_sigma.sigma_px);
}

bool hardlyDetermined(double relative_sigma) {
  constexpr double kHardly = 0.25;
  return !(relative_sigma <= kHardly);
}

void printNoise(const std::string& recording, const NoiseCalibration& calibration, double overlap) {
  std::printf("\n%s\n", recording.c_str());
  if (!calibration.message.empty()) std::printf("  %s\n", calibration.message.c_str());
  if (calibration.iterations.empty() || calibration.iterations.front().windows == 0) return;
  std::printf("  with the factors as configured, alike in all windows:\n");
  for (const std::string& sentence : describe(calibration.iterations.front().check, overlap))
    std::printf("    %s\n", sentence.c_str());
  if (hardlyDetermined(calibration.relative_sigma.gyro))
    std::printf("  the gyro's factor is hardly determined: +- %.0f %%\n",
                100.0 * calibration.relative_sigma.gyro);
  if (hardlyDetermined(calibration.relative_sigma.accel))
    std::printf("  the accelerometer's factor is hardly determined: +- %.0f %%\n",
                100.0 * calibration.relative_sigma.accel);
}

}  // namespace etalon::app
