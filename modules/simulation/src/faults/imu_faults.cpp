#include "imu_faults.h"

#include "etalon/core/angles.h"
#include "fault_list.h"

namespace etalon {

ImuBias addedBias(const std::vector<Fault>& faults, double s, std::uint64_t seed) {
  ImuBias added;
  forEachFaultAt<faults::BiasJump>(faults, s, [&](const faults::BiasJump& fault, size_t i) {
    Random random = faultRandom(seed, i, 0);
    added.gyro += radians(fault.gyro_dps) * random.direction();
    added.accel += fault.accel_mps2 * random.direction();
  });
  return added;
}

void applyImuFaults(const std::vector<Fault>& faults, double s, std::uint64_t seed,
                    ImuSample* sample) {
  const ImuBias added = addedBias(faults, s, seed);
  sample->gyro += added.gyro;
  sample->accel += added.accel;
  forEachFaultAt<faults::ImuLimit>(faults, s, [&](const faults::ImuLimit& fault, size_t) {
    const double rate = radians(fault.gyro_dps);
    sample->gyro = sample->gyro.cwiseMax(-rate).cwiseMin(rate);
    sample->accel = sample->accel.cwiseMax(-fault.accel_mps2).cwiseMin(fault.accel_mps2);
  });
}

}  // namespace etalon
