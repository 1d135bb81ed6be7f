// turn_by_span SRC [--ground-truth FILE] [--turn X,Y,Z --hz F]
//
// Is the recorded body turned against the IMU's by one angle, or only in slow motion? The gyro's
// rotation over a span, without any smoothing, is compared with the recorded one over the same span:
// the two rotation vectors differ by the turn (and a constant bias), which is fitted by least
// squares. A body that is turned gives the same turn at all spans; a recording that follows a turned
// tracker only below a bandwidth, and the gyro above it, gives the more of the turn the longer the
// span. Standard errors by a jackknife over twenty parts of the recording. With --turn (deg) and
// --hz the same of a recording made from the gyro by that rule (docs/ground_truth.md, L of first
// order), which is what to compare with.

#include <Eigen/Cholesky>
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <string>
#include <vector>

#include "etalon/core/angles.h"
#include "etalon/core/errors.h"
#include "etalon/core/so3.h"
#include "etalon/datasets/recorded_source.h"
#include "etalon/testing/program.h"

namespace {

using namespace etalon;
using Eigen::Matrix3d;
using Eigen::Vector3d;
using Vector6 = Eigen::Matrix<double, 6, 1>;
using Matrix6 = Eigen::Matrix<double, 6, 6>;

constexpr double kSpans_s[] = {0.1, 0.25, 0.5, 1.0, 2.0, 4.0, 8.0};
constexpr int kParts = 20;
constexpr double kLargest = 2.8;      // rad: near pi a rotation vector is not unique
constexpr double kTolerance = 0.015;  // s, of a span

/** Rotations at a row's stamp: of the recording, and of the gyro since its first sample. */
struct Row {
  TimeNs t = 0;
  Matrix3d recorded, gyro;
};

/** Mean gyro bias that the rows show over short steps. */
Vector3d roughBias(const std::vector<StampedState>& rows, const std::vector<ImuSample>& imu) {
  Vector3d rate = Vector3d::Zero(), turned = Vector3d::Zero();
  double time = 0.0;
  for (size_t k = 1; k < rows.size(); ++k) {
    const double dt = secondsBetween(rows[k - 1].t, rows[k].t);
    if (dt > 0.1) continue;
    turned += logSO3(rows[k - 1].T_WB.R.transpose() * rows[k].T_WB.R);
    time += dt;
  }
  for (const ImuSample& sample : imu) rate += sample.gyro / static_cast<double>(imu.size());
  return rate - turned / time;
}

std::vector<Row> rowsOf(const std::vector<StampedState>& states,
                        const std::vector<ImuSample>& imu) {
  const Vector3d bias = roughBias(states, imu);
  std::vector<Row> rows;
  Matrix3d R = Matrix3d::Identity();
  size_t next = 0;
  for (size_t k = 0; k + 1 < imu.size(); ++k) {
    const double dt = secondsBetween(imu[k].t, imu[k + 1].t);
    const Vector3d rate = 0.5 * (imu[k].gyro + imu[k + 1].gyro) - bias;
    for (; next < states.size() && states[next].t < imu[k + 1].t; ++next) {
      if (states[next].t < imu[k].t) continue;
      const double part = secondsBetween(imu[k].t, states[next].t);
      rows.push_back({states[next].t, states[next].T_WB.R, R * expSO3(part * rate)});
    }
    R = R * expSO3(dt * rate);
  }
  return rows;
}

/** The recorded rotations replaced by the gyro's and a low-passed offset of a turned body. */
void makeRecorded(const Vector3d& turn, double hz, std::vector<Row>* rows) {
  Vector3d offset = rows->front().gyro * turn;
  std::vector<Vector3d> offsets;
  const auto pass = [&](const Vector3d& in, double dt) {
    const double keep = std::exp(-2.0 * M_PI * hz * dt);
    offset = keep * offset + (1.0 - keep) * in;
    return offset;
  };
  const size_t n = rows->size();
  for (size_t k = 0; k < n; ++k) {
    const double dt = k > 0 ? secondsBetween((*rows)[k - 1].t, (*rows)[k].t) : 0.0;
    offsets.push_back(pass((*rows)[k].gyro * turn, dt));
  }
  for (size_t k = n; k-- > 0;) {
    const double dt = k + 1 < n ? secondsBetween((*rows)[k].t, (*rows)[k + 1].t) : 0.0;
    offsets[k] = pass(offsets[k], dt);
    (*rows)[k].recorded = expSO3(offsets[k]) * (*rows)[k].gyro;
  }
}

/** Turn (rad) and bias (rad/s) from the normal equations of all parts but one. */
Vector6 solved(const std::vector<Matrix6>& H, const std::vector<Vector6>& b, int left_out) {
  Matrix6 sum = 1e-12 * Matrix6::Identity();
  Vector6 rhs = Vector6::Zero();
  for (int part = 0; part < kParts; ++part) {
    if (part == left_out) continue;
    sum += H[part];
    rhs += b[part];
  }
  return sum.ldlt().solve(rhs);
}

void printTurn(const std::vector<Row>& rows, double span_s) {
  std::vector<Matrix6> H(kParts, Matrix6::Zero());
  std::vector<Vector6> b(kParts, Vector6::Zero());
  size_t j = 0;
  for (size_t i = 0; i < rows.size(); ++i) {
    while (j < rows.size() && secondsBetween(rows[i].t, rows[j].t) < span_s) ++j;
    if (j == rows.size()) break;
    if (std::abs(secondsBetween(rows[i].t, rows[j].t) - span_s) > kTolerance) continue;
    const Vector3d gyro = logSO3(rows[i].gyro.transpose() * rows[j].gyro);
    if (gyro.norm() > kLargest) continue;
    // Log of Exp(-turn) R Exp(turn) is Exp(-turn) Log(R), to first order Log(R) + Log(R) x turn.
    Eigen::Matrix<double, 3, 6> J;
    J << hat(gyro), -span_s * Matrix3d::Identity();
    const Vector3d off = logSO3(rows[i].recorded.transpose() * rows[j].recorded) - gyro;
    const size_t part = i * kParts / rows.size();
    H[part] += J.transpose() * J;
    b[part] += J.transpose() * off;
  }
  const Vector6 all = solved(H, b, -1);
  Vector6 mean = Vector6::Zero(), variance = Vector6::Zero();
  for (int part = 0; part < kParts; ++part) mean += solved(H, b, part) / kParts;
  for (int part = 0; part < kParts; ++part)
    variance += (solved(H, b, part) - mean).cwiseAbs2() * ((kParts - 1.0) / kParts);
  std::printf("span %4.2f s: turned about x, y, z, deg", span_s);
  for (int i = 0; i < 3; ++i)
    std::printf("  %6.3f +- %.3f", degrees(all[i]), degrees(std::sqrt(variance[i])));
  std::printf("\n");
}

struct Arguments {
  std::string source, ground_truth;
  std::vector<double> turn_deg;
  double hz = 0.0;
};

void run(const Arguments& arguments) {
  SourceOptions options;
  options.decode_images = false;
  options.ground_truth = arguments.ground_truth;
  const auto recording = openRecording(arguments.source, options);
  std::vector<Row> rows = rowsOf(recording->groundTruth().states, recording->imuSamples());
  if (rows.empty()) throw DataError(arguments.source, 0, "has no ground truth in the IMU's time");
  if (!arguments.turn_deg.empty())
    makeRecorded(radians(1.0) * Eigen::Map<const Vector3d>(arguments.turn_deg.data()), arguments.hz,
                 &rows);
  for (const double span_s : kSpans_s) printTurn(rows, span_s);
}

}  // namespace

int main(int argc, char** argv) {
  Arguments arguments;
  CLI::App app("By how much a recorded body is turned, by the span of the rotations",
               "turn_by_span");
  app.add_option("SRC", arguments.source, "Recording")->required();
  app.add_option("--ground-truth", arguments.ground_truth, "In place of the recording's own");
  CLI::Option* hz = app.add_option("--hz", arguments.hz, "Bandwidth of the model's recording");
  app.add_option("--turn", arguments.turn_deg, "Of the model's recording, about x, y, z, deg")
      ->delimiter(',')
      ->expected(3)
      ->needs(hz);
  return testing::runProgram(&app, argc, argv, [&] { run(arguments); });
}
