#include <Eigen/Cholesky>
#include <Eigen/QR>

#include "etalon/core/so3.h"
#include "etalon/core/stopwatch.h"
#include "etalon/initialization/initializer.h"
#include "etalon/initialization/steps/gravity_alignment.h"

namespace my_lab {

using Eigen::Matrix3d;
using Eigen::Vector3d;
using etalon::Bound;
using etalon::refuse;
using etalon::Value;
using Status = etalon::RefusalStatus;

/**
 * Loosely coupled: the poses of stereo odometry stay as they are; b_g from their
 * rotations, then velocities and gravity by linear least squares. b_a stays at the prior's mean.
 */
class LooselyCoupled : public etalon::Initializer {
  DEFINE_MRPT_OBJECT(LooselyCoupled, my_lab)

 public:
  void declareParameters(etalon::ParameterSet& parameters) override {
    parameters.add("min_landmarks", &min_landmarks_, {3, 100000},
                   "Refuse if stereo odometry has fewer landmarks in the window.");
    parameters.add("max_gyro_bias_rps", &max_gyro_bias_rps_, {0.0, 10.0},
                   "Refuse if the gyro bias found is larger, rad/s.");
    parameters.add("max_gravity_error_mps2", &max_gravity_error_mps2_, {0.0, 10.0},
                   "Refuse if the gravity found differs by more from its known magnitude, m/s^2.");
  }
  bool needsVisualSolution() const override { return true; }

 protected:
  etalon::InitializationResult solve(const etalon::InitializationProblem& problem) const override {
    const etalon::Expected<etalon::VisualSolution>& visual = problem.visualSolution();
    if (!visual) return refuse(visual.error());
    const int landmarks = visual->landmarks.size();
    if (landmarks < min_landmarks_)
      return refuse(Status::kTooFewTracks, Value(landmarks), " landmarks in the window, at least ",
                    Bound(min_landmarks_), " are wanted");
    if (problem.keyframeCount() < 3)  // fewer equations than unknowns
      return refuse(Status::kTooFewKeyframes, Value(problem.keyframeCount()),
                    " keyframes, at least ", Bound(3), " are needed");

    etalon::Stopwatch watch;
    etalon::VisualFrameEstimate estimate;
    estimate.T_VB = visual->T_VB;
    estimate.landmarks = visual->landmarks;
    estimate.bias.accel = problem.priors().mean.accel;
    estimate.bias.gyro = gyroBias(problem, *visual);
    const double gyro_bias = estimate.bias.gyro.norm();
    if (!(gyro_bias <= max_gyro_bias_rps_))
      return refuse(Status::kImplausible, "a gyro bias of ", Value(gyro_bias), " rad/s, at most ",
                    Bound(max_gyro_bias_rps_), " is plausible");

    const double gravity_error = findVelocitiesAndGravity(problem, &estimate);
    if (!(gravity_error <= max_gravity_error_mps2_))
      return refuse(Status::kIllConditioned, "the magnitude of gravity is off by ",
                    Value(gravity_error), " m/s^2, at most ", Bound(max_gravity_error_mps2_),
                    " is wanted");
    etalon::Initialization result = etalon::alignWithGravity(problem, estimate);
    result.timings.push_back({"linear", watch.lapMilliseconds()});
    return result;
  }

 private:
  /** The b_g (rad/s) for which the integrated gyro turns from keyframe to keyframe as the camera
   * did: Log(dR(b_g)^T R_VBk-1^T R_VBk) = 0 in the least squares, Gauss-Newton. */
  static Vector3d gyroBias(const etalon::InitializationProblem& problem,
                           const etalon::VisualSolution& visual) {
    etalon::ImuBias bias = problem.priors().mean;
    for (int iteration = 0; iteration < 5; ++iteration) {
      Matrix3d H = Matrix3d::Zero();
      Vector3d b = Vector3d::Zero();
      const auto preintegrations = problem.preintegrate(bias);
      for (size_t k = 0; k < preintegrations.size(); ++k) {
        const etalon::Preintegration& p = preintegrations[k];
        const Matrix3d R_visual = visual.T_VB[k].R.transpose() * visual.T_VB[k + 1].R;
        const Vector3d r = etalon::logSO3(p.deltas().dR.transpose() * R_visual);
        H += p.dR_dbg().transpose() * p.dR_dbg();
        b += p.dR_dbg().transpose() * r;
      }
      bias.gyro += H.ldlt().solve(b);
    }
    return bias.gyro;
  }

  /** Fills v_VB and g_V; returns how far the magnitude of gravity was off before it was put
   * right, m/s^2. */
  static double findVelocitiesAndGravity(const etalon::InitializationProblem& problem,
                                         etalon::VisualFrameEstimate* estimate) {
    // For every pair, with R, p the poses and dt, dp, dv the preintegration (docs/notation.md):
    //   v_k + g dt/2     = (p_k+1 - p_k - R_k dp) / dt
    //   v_k+1 - v_k - g dt = R_k dv
    const auto preintegrations = problem.preintegrate(estimate->bias);
    const Eigen::Index n = estimate->T_VB.size();
    Eigen::MatrixXd A = Eigen::MatrixXd::Zero(6 * (n - 1), 3 * n + 3);
    Eigen::VectorXd b(6 * (n - 1));
    for (Eigen::Index k = 0; k + 1 < n; ++k) {
      const etalon::SE3& T_k = estimate->T_VB[k];
      const etalon::SE3& T_next = estimate->T_VB[k + 1];
      const etalon::Preintegration& p = preintegrations[k];
      const double dt = p.dt();
      A.block<3, 3>(6 * k, 3 * k).setIdentity();
      A.block<3, 3>(6 * k, 3 * n) = 0.5 * dt * Matrix3d::Identity();
      b.segment<3>(6 * k) = (T_next.t - T_k.t - T_k.R * p.deltas().dp) / dt;
      A.block<3, 3>(6 * k + 3, 3 * k) = -Matrix3d::Identity();
      A.block<3, 3>(6 * k + 3, 3 * k + 3).setIdentity();
      A.block<3, 3>(6 * k + 3, 3 * n) = -dt * Matrix3d::Identity();
      b.segment<3>(6 * k + 3) = T_k.R * p.deltas().dv;
    }
    const Vector3d g_V = A.colPivHouseholderQr().solve(b).tail<3>();
    estimate->g_V = problem.gravityMagnitude() * g_V.normalized();
    const Eigen::VectorXd v =
        A.leftCols(3 * n).colPivHouseholderQr().solve(b - A.rightCols(3) * estimate->g_V);
    for (Eigen::Index k = 0; k < n; ++k) estimate->v_VB.emplace_back(v.segment<3>(3 * k));
    return std::abs(g_V.norm() - problem.gravityMagnitude());
  }

  int min_landmarks_ = 15;
  double max_gyro_bias_rps_ = 0.5;
  double max_gravity_error_mps2_ = 1.0;
};

IMPLEMENTS_MRPT_OBJECT(LooselyCoupled, etalon::Initializer, my_lab)

}  // namespace my_lab

ETALON_REGISTER_INITIALIZER(LooselyCoupled, my_lab, "loosely_coupled", "1.0",
                            "gyro bias, velocities and gravity by least squares on visual poses")
