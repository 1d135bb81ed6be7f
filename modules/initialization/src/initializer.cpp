#include "etalon/initialization/initializer.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <exception>

#include "etalon/core/errors.h"
#include "etalon/core/printable.h"
#include "etalon/imu/imu_limits.h"

namespace etalon {

IMPLEMENTS_VIRTUAL_MRPT_OBJECT(Initializer, mrpt::rtti::CObject, etalon)

namespace {

using Status = RefusalStatus;

Expected<void> checkFrames(const InitializationProblem& problem) {
  const auto& frames = problem.frames();
  for (size_t i = 0; i < frames.size(); ++i) {
    if (i > 0 && frames[i].t <= frames[i - 1].t) {
      return refuse(Status::kInvalidInput, "frame ", Value(i),
                    " of the window is not later than the one before");
    }
    for (const Observation& o : frames[i].observations) {
      if (!o.left.allFinite() || (o.has_right && !o.right.allFinite())) {
        return refuse(Status::kInvalidInput, "landmark ", o.id, " in frame ", Value(i),
                      " of the window has a pixel that is not finite");
      }
    }
  }
  return {};
}

/** Seconds at the ends of [t0, t1] that the samples do not cover; all of it without samples. */
double secondsNotCovered(const ImuBuffer& imu, TimeNs t0, TimeNs t1) {
  if (imu.empty()) return secondsBetween(t0, t1);
  return std::max(0.0, secondsBetween(t0, imu.samples().front().t)) +
         std::max(0.0, secondsBetween(imu.samples().back().t, t1));
}

Expected<void> checkImu(const InitializationProblem& problem) {
  const ImuBuffer& imu = problem.imu();
  const TimeNs t0 = problem.keyframe(0).t;
  const TimeNs t1 = problem.keyframe(problem.keyframeCount() - 1).t;
  if (!imu.covers(t0, t1)) {
    return refuse(Status::kImuGap, "the IMU leaves ", Value(secondsNotCovered(imu, t0, t1)),
                  " s of the window's ", secondsBetween(t0, t1), " s uncovered");
  }
  for (size_t i = 0; i < imu.samples().size(); ++i) {
    const ImuSample& sample = imu.samples()[i];
    if (!sample.gyro.allFinite() || !sample.accel.allFinite()) {
      return refuse(Status::kInvalidInput, "IMU sample ", Value(i), " is not finite");
    }
  }
  const double rate_hz = problem.calibration().imu.rate_hz;
  if (!std::isfinite(rate_hz) || rate_hz <= 0.0) {
    return refuse(Status::kInvalidInput, "the calibration's nominal IMU rate is ", Value(rate_hz),
                  " Hz");
  }
  const double gap = imu.longestGap(t0, t1);
  const double allowed = longestImuStep(rate_hz);
  if (gap > allowed) {
    return refuse(Status::kImuGap, "the IMU has a gap of ", Value(gap), " s, at most ",
                  Bound(allowed), " s can be bridged");
  }
  return {};
}

Expected<void> checkProblem(const InitializationProblem& problem) {
  if (problem.keyframeCount() < 2) {
    return refuse(Status::kTooFewKeyframes, "the window has ", Value(problem.keyframeCount()),
                  " keyframes, at least ", Bound(2), " are needed");
  }
  if (auto frames = checkFrames(problem); !frames) return frames;
  return checkImu(problem);
}

/** Whether R is a rotation, within the rounding errors of a long product of rotations. */
bool isRotation(const Eigen::Matrix3d& R) {
  constexpr double kTolerance = 1e-6;
  return (R.transpose() * R - Eigen::Matrix3d::Identity()).norm() < kTolerance &&
         R.determinant() > 0.0;
}

/** What is wrong with a reported success, in words; empty if nothing. */
std::string brokenPromise(const InitializationProblem& problem, const Initialization& result) {
  if (static_cast<int>(result.states.size()) != problem.keyframeCount()) {
    return std::to_string(result.states.size()) + " states for " +
           std::to_string(problem.keyframeCount()) + " keyframes";
  }
  for (int k = 0; k < problem.keyframeCount(); ++k) {
    const StampedState& state = result.states[k];
    const std::string where = " at keyframe " + std::to_string(k);
    if (state.t != problem.keyframe(k).t) return "another stamp than the keyframe's" + where;
    if (!state.T_WB.R.allFinite() || !state.T_WB.t.allFinite()) return "a T_WB not finite" + where;
    if (!state.v_WB.allFinite()) return "a v_WB not finite" + where;
    if (!isRotation(state.T_WB.R)) return "a T_WB that is no rigid transform" + where;
  }
  if (!result.bias.gyro.allFinite()) return "a gyro bias not finite";
  if (!result.bias.accel.allFinite()) return "an accelerometer bias not finite";
  for (const auto& [id, p_W] : result.landmarks) {
    if (!p_W.allFinite()) return "a position not finite for landmark " + std::to_string(id);
  }
  const Eigen::Index rows = result.covariance.rows(), poses = 6 * (problem.keyframeCount() - 1);
  if (result.covariance.size() > 0 &&
      (rows != result.covariance.cols() || (rows != 11 && rows != 11 + poses)))
    return "a covariance that is neither 11 x 11 nor, with the poses, " +
           std::to_string(11 + poses) + " square";
  if (!result.covariance.allFinite()) return "a covariance not finite";
  if (result.T_BC && !(result.T_BC->t.allFinite() && isRotation(result.T_BC->R)))
    return "a T_BC that is no rigid transform";
  return "";
}

/** The reason may be a plugin's own words. */
InitializationResult checkedResult(const InitializationProblem& problem,
                                   InitializationResult result) {
  if (!result) {
    std::string& reason = result.error().reason;
    reason = printable(reason.empty() ? std::string("refused without a reason (") +
                                            toString(result.error().status) + ")"
                                      : reason);
    return result;
  }
  const std::string broken = brokenPromise(problem, *result);
  if (broken.empty()) {
    for (StampedState& state : result->states) state.bias = result->bias;
    return result;
  }
  return refuse(Status::kNotConverged, "the initializer reports success with ", broken);
}

}  // namespace

inline namespace ETALON_INITIALIZER_NAMESPACE {

InitializationResult Initializer::initialize(const InitializationProblem& problem) const {
  if (const auto check = checkProblem(problem); !check) return refuse(check.error());
  try {
    return checkedResult(problem, solve(problem));
  } catch (const DataError& e) {
    return refuse(Status::kInvalidInput, printable(e.what()));
  } catch (const std::exception& e) {
    return refuse(Status::kNotConverged, printable(e.what()));
  } catch (...) {
    return refuse(Status::kNotConverged, "the initializer threw what is no std::exception");
  }
}

}  // namespace ETALON_INITIALIZER_NAMESPACE

void registerInitializerClass(const mrpt::rtti::TRuntimeClassId* class_id) {
  if (!mrpt::rtti::findRegisteredClass(class_id->className, false)) {
    mrpt::rtti::registerClass(class_id);
  }
}

}  // namespace etalon
