#include "etalon/datasets/euroc_files.h"

#include <Eigen/Geometry>
#include <cmath>

#include "etalon/core/errors.h"
#include "euroc/csv_reader.h"
#include "stamped_rows.h"

namespace etalon {

namespace {

Eigen::Vector3d vectorAt(const CsvReader& csv, size_t first) {
  return {csv.number(first), csv.number(first + 1), csv.number(first + 2)};
}

StampedState parseState(const CsvReader& csv) {
  StampedState state;
  state.t = csv.stamp();
  const Eigen::Quaterniond q(csv.number(4), csv.number(5), csv.number(6), csv.number(7));
  if (std::abs(q.norm() - 1.0) > 1e-2)
    csv.fail("expected a unit quaternion (w, x, y, z) in columns 5 to 8, found norm " +
             std::to_string(q.norm()));
  state.T_WB = SE3(q.normalized().toRotationMatrix(), vectorAt(csv, 1));
  if (csv.size() == 17) {
    state.v_WB = vectorAt(csv, 8);
    state.bias.gyro = vectorAt(csv, 11);
    state.bias.accel = vectorAt(csv, 14);
  }
  return state;
}

}  // namespace

GroundTruth readGroundTruthCsv(const std::string& path, size_t min_states) {
  CsvReader csv(path,
                "8 or 17 columns (stamp [ns], position, quaternion w x y z, and velocity, gyro "
                "bias, accelerometer bias)");
  GroundTruth truth;
  std::vector<size_t> counts = {8, 17};
  while (csv.next(counts)) {
    counts = {csv.size()};
    truth.states.push_back(parseState(csv));
    truth.has_velocity = truth.has_biases = csv.size() == 17;
  }
  if (truth.states.size() < min_states)
    throw DataError(path, 0,
                    "expected at least " + std::to_string(min_states) +
                        " states of the ground truth, found " +
                        std::to_string(truth.states.size()));
  return truth;
}

std::vector<ImuSample> readImuCsv(const std::string& path, std::vector<std::string>* warnings) {
  CsvReader csv(path, "7 columns (stamp [ns], 3 x rate [rad/s], 3 x acceleration [m/s^2])",
                StampOrder::kAny);
  const auto measuredAt = [&csv](size_t first) -> Eigen::Vector3d {
    return {csv.measurement(first), csv.measurement(first + 1), csv.measurement(first + 2)};
  };
  std::vector<ImuSample> samples;
  while (csv.next({7})) samples.push_back({csv.stamp(), measuredAt(1), measuredAt(4)});
  putInOrder(path, "samples", &samples, warnings);
  if (samples.size() < 2) throw DataError(path, 0, "expected at least two IMU samples");
  return samples;
}

std::vector<TimeNs> readStamps(const std::string& path) {
  CsvReader csv(path, "1 column (stamp [ns])");
  std::vector<TimeNs> stamps;
  while (csv.next({1})) stamps.push_back(csv.stamp());
  if (stamps.empty()) throw DataError(path, 0, "expected at least one stamp");
  return stamps;
}

}  // namespace etalon
