#include "calibration_watch.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

#include "etalon/core/angles.h"
#include "etalon/core/text.h"
#include "fixed_lag/window_solver.h"

namespace etalon::fixed_lag {
namespace {

constexpr double kReadEvery = 1.0;             // s
constexpr double kPiece = 5.0;                 // s
constexpr double kSettledTilt = radians(0.5);  // rad
constexpr double kSettledVelocity = 0.05;      // m/s
constexpr double kObserved = 0.5;              // of the standard deviation before any measurement
constexpr double kPlausible = 5.0;             // such standard deviations
// Standard deviations. It is asked once a second, so that three would happen by chance.
constexpr double kSignificant = 4.0;
// While too few pieces have passed to know how the estimate moves.
constexpr int kFewestPieces = 3;
constexpr double kEarlyWidening = 3.0;
// Squared inertial residuals over their number, after the fit: noise as it is believed stays below one.
// The readings over which they are averaged, and what is said to be a contradiction.
constexpr double kInertialReadings = 5.0;
constexpr double kContradiction = 4.0;
// A change that is short beside what is known is not worth its time.
constexpr double kWorthMoving = 0.5;

bool isSettled(const OdometryOutput& output) {
  const Eigen::Matrix3d& R = output.state.T_WB.R;
  const Eigen::Matrix3d attitude = R * output.covariance.block<3, 3>(0, 0) * R.transpose();
  return output.unlocated_s == 0.0 && output.covariance.trace() > 0.0 &&
         std::sqrt(std::max(attitude(0, 0), attitude(1, 1))) < kSettledTilt &&
         std::sqrt(output.covariance.block<3, 3>(6, 6).trace()) < kSettledVelocity;
}

/** The solution of the equations in some columns, the others at zero. */
CalibrationVector solution(const CalibrationInformation& information,
                           const std::vector<Eigen::Index>& columns, CalibrationVector* variance) {
  const auto n = static_cast<Eigen::Index>(columns.size());
  const Eigen::MatrixXd P = Eigen::MatrixXd(information.matrix(columns, columns))
                                .llt()
                                .solve(Eigen::MatrixXd::Identity(n, n));
  CalibrationVector mean = CalibrationVector::Zero();
  mean(columns) = P * information.vector(columns);
  variance->setZero();
  (*variance)(columns) = P.diagonal();
  return mean;
}

}  // namespace

const std::array<CalibrationQuantity, kQuantityCount> kCalibrationQuantities = {{
    {"time_offset", "time offset", "ms", kTimeOffset, 1, 1e3, 1e-4,
     &CalibrationOptions::time_offset, "the images are later than their stamps",
     "the images are earlier than their stamps"},
    {"extrinsics", "rotation of the cameras in the body", "deg", kCameraRotation, 3,
     kDegreesPerRadian, radians(0.02), &CalibrationOptions::extrinsics, nullptr, nullptr},
    {"extrinsics", "position of the cameras in the body", "mm", kCameraPosition, 3, 1e3, 1.5e-3,
     &CalibrationOptions::extrinsics, nullptr, nullptr},
    {"extrinsics", "rotation between the cameras", "deg", kStereoRotation, 3, kDegreesPerRadian,
     radians(0.004), &CalibrationOptions::extrinsics, nullptr, nullptr},
    {"extrinsics", "baseline", "%", kBaseline, 1, 1e2, 1e-3, &CalibrationOptions::extrinsics,
     "the given one is too short", "the given one is too long"},
    {"extrinsics", "right camera across the baseline", "mm", kStereoShift, 2, 1e3, 4e-5,
     &CalibrationOptions::extrinsics, nullptr, nullptr},
    {"intrinsics", "focal lengths", "%", kFocal, 2, 1e2, 5e-4, &CalibrationOptions::intrinsics,
     nullptr, nullptr},
    {"intrinsics", "principal points", "px", kPrincipalPoint, 4, 1.0, 0.2,
     &CalibrationOptions::intrinsics, nullptr, nullptr},
    {"intrinsics", "radial distortion", "px", kRadialDistortion, 2 * kRadialShifts, 1.0, 0.02,
     &CalibrationOptions::intrinsics, nullptr, nullptr},
}};

std::optional<CalibrationInformation> calibrationInformation(const LinearRows& prior) {
  const Eigen::Index n = prior.unknowns() - kCalibrationSize;
  const Eigen::MatrixXd H = prior.A.transpose() * prior.A;
  const Eigen::VectorXd g = prior.A.transpose() * prior.b;
  CalibrationInformation of;
  const Eigen::VectorXd scale = H.diagonal().tail(n).cwiseMax(1e-12).cwiseSqrt().cwiseInverse();
  const Eigen::MatrixXd scaled =
      scale.asDiagonal() * H.bottomRightCorner(n, n) * scale.asDiagonal();
  const Eigen::LLT<Eigen::MatrixXd> factor(scaled);
  if (factor.info() != Eigen::Success) return std::nullopt;
  Eigen::MatrixXd both(n, kCalibrationSize + 1);
  both << H.bottomLeftCorner(n, kCalibrationSize), g.tail(n);
  both = scale.asDiagonal() * both;
  factor.matrixL().solveInPlace(both);
  const auto left = both.leftCols<kCalibrationSize>();
  of.matrix = H.topLeftCorner<kCalibrationSize, kCalibrationSize>() - left.transpose() * left;
  of.vector = -g.head<kCalibrationSize>() + left.transpose() * both.rightCols<1>();
  return of;
}

CalibrationWatch::CalibrationWatch(const CalibrationOptions& options, const CalibrationVector& used)
    : options_(options), used_(used) {
  now_.variance = calibrationPriorSigma().cwiseAbs2();
  for (size_t i = 0; i < kQuantityCount; ++i) {
    const CalibrationQuantity& q = kCalibrationQuantities[i];
    in_use_[i] = !used.segment(q.first, q.size).isZero(0.0);
  }
}

bool CalibrationWatch::isFree(Eigen::Index column) const {
  if (column >= kFocal) return options_.intrinsics != CalibrationMode::kOff;
  return (column == kTimeOffset ? options_.time_offset : options_.extrinsics) !=
         CalibrationMode::kOff;
}

void CalibrationWatch::estimate(const CalibrationInformation& information) {
  std::vector<Eigen::Index> free;
  for (Eigen::Index c = 0; c < kCalibrationSize; ++c)
    if (isFree(c)) free.push_back(c);
  now_.mean = solution(information, free, &now_.variance);
}

/** The estimate moves by what its variance loses, if that is right. */
void CalibrationWatch::followScatter(TimeNs t) {
  if (piece_began_ != 0 && secondsBetween(piece_began_, t) < kPiece) return;
  if (piece_began_ != 0) {
    for (Eigen::Index c = 0; c < kCalibrationSize; ++c) {
      const double lost = piece_begin_.variance[c] - now_.variance[c];
      if (lost > 0.0) scatter_[c] += std::pow(now_.mean[c] - piece_begin_.mean[c], 2) / lost;
    }
    ++pieces_;
  }
  piece_begin_ = now_;
  piece_began_ = t;
}

/** Nine rows of each inertial term: those of the biases' walk are nearly zero. */
void CalibrationWatch::followInertial(const Window& window) {
  double squares = 0.0, rows = 0.0;
  for (size_t i = window.firstFull() + 1; i < window.states.size(); ++i) {
    squares += inertialRows(window, i).head<9>().squaredNorm();
    rows += 9.0;
  }
  if (rows == 0.0) return;
  ++inertial_readings_;
  inertial_ += (squares / rows - inertial_) / std::min(inertial_readings_, kInertialReadings);
  if (contradiction_said_ || inertial_readings_ < kInertialReadings || inertial_ < kContradiction)
    return;
  contradiction_said_ = true;
  remarks_.push_back(format(
      "the IMU contradicts the images %.0f times as much as its noise lets it: is [imu_noise] "
      "too small, or the calibration wrong?",
      std::sqrt(inertial_)));
}

double CalibrationWatch::widening(Eigen::Index column) const {
  const double noisier = std::sqrt(std::max(1.0, inertial_));
  if (pieces_ < kFewestPieces) return noisier * kEarlyWidening;
  return noisier * std::max(1.0, std::sqrt(scatter_[column] / pieces_));
}

/** The widened standard deviation, without what no flight averages out. */
double CalibrationWatch::sigma(const CalibrationQuantity& quantity, Eigen::Index column) const {
  const double scale = quantity.first == kBaseline ? options_.accel_scale_sigma
                       : quantity.first == kFocal  ? options_.gyro_scale_sigma
                                                   : 0.0;
  return std::hypot(widening(column) * std::sqrt(now_.variance[column]), scale);
}

CalibrationFinding CalibrationWatch::judge(const CalibrationQuantity& q) const {
  using Verdict = CalibrationFinding::Verdict;
  CalibrationFinding finding{q.group, q.name, q.unit, {}, {}, {}, {}, Verdict::kAgrees, {}};
  const CalibrationVector before = calibrationPriorSigma();
  finding.value = q.unit_scale * now_.mean.segment(q.first, q.size);
  finding.used = q.unit_scale * used_.segment(q.first, q.size);
  finding.formal_sigma = q.unit_scale * now_.variance.segment(q.first, q.size).cwiseSqrt();
  finding.sigma.resize(q.size);
  bool observed = false, off = false, implausible = false;
  for (Eigen::Index i = 0; i < q.size; ++i) {
    const Eigen::Index c = q.first + i;
    const double total = std::hypot(sigma(q, c), q.systematic), value = std::abs(now_.mean[c]);
    finding.sigma[i] = q.unit_scale * std::min(before[c], total);
    // What is far from zero has been told, however little was known before.
    const bool told = widening(c) * std::sqrt(now_.variance[c]) < kObserved * before[c] ||
                      value > kDoubtful * total;
    if (!settled_ || !told) continue;
    observed = true;
    finding.sigma[i] = q.unit_scale * total;
    off = off || value > kSignificant * total;
    implausible = implausible || value > kPlausible * before[c];
  }
  finding.verdict = !observed     ? Verdict::kNotObserved
                    : implausible ? Verdict::kImplausible
                    : off         ? Verdict::kOff
                                  : Verdict::kAgrees;
  return finding;
}

/** Which quantities are corrected. */
void CalibrationWatch::choose() {
  for (size_t i = 0; i < kQuantityCount; ++i) {
    const CalibrationQuantity& q = kCalibrationQuantities[i];
    const CalibrationMode mode = options_.*q.mode;
    if (mode == CalibrationMode::kOff) continue;
    CalibrationFinding finding = judge(q);
    const bool off = finding.verdict == CalibrationFinding::Verdict::kOff;
    const bool before = in_use_[i];
    in_use_[i] = finding.verdict != CalibrationFinding::Verdict::kImplausible &&
                 (before || off || mode == CalibrationMode::kOn);
    if (!before && off) {
      finding.used = finding.value;
      remarks_.push_back(inWords(finding, q, settled_));
    }
  }
}

CalibrationVector CalibrationWatch::toUse(const CalibrationInformation& information,
                                          const CalibrationVector& now) const {
  std::vector<Eigen::Index> columns;
  for (size_t i = 0; i < kQuantityCount; ++i)
    for (Eigen::Index c = 0; in_use_[i] && c < kCalibrationQuantities[i].size; ++c)
      columns.push_back(kCalibrationQuantities[i].first + c);
  if (columns.empty()) return CalibrationVector::Zero();
  CalibrationVector variance;
  const CalibrationVector best = solution(information, columns, &variance);
  const CalibrationVector least = kWorthMoving * variance.cwiseSqrt();
  return ((best - now).cwiseAbs().array() > least.array()).any() ? best : now;
}

std::optional<CalibrationVector> CalibrationWatch::update(const Window& window,
                                                          const OdometryOutput& output) {
  settled_ = settled_ || isSettled(output);
  if (!settled_ || (read_at_ != 0 && secondsBetween(read_at_, output.t) < kReadEvery))
    return std::nullopt;
  read_at_ = output.t;
  const auto information = calibrationInformation(window.prior);
  if (!information) return std::nullopt;
  estimate(*information);
  followScatter(output.t);
  followInertial(window);
  choose();
  used_ = toUse(*information, window.calibration.now);
  if (used_ == window.calibration.now) return std::nullopt;
  return used_;
}

std::vector<CalibrationFinding> CalibrationWatch::findings() const {
  std::vector<CalibrationFinding> findings;
  for (const CalibrationQuantity& q : kCalibrationQuantities) {
    if (options_.*q.mode == CalibrationMode::kOff) continue;
    findings.push_back(judge(q));
    findings.back().words = inWords(findings.back(), q, settled_);
  }
  return findings;
}

}  // namespace etalon::fixed_lag
