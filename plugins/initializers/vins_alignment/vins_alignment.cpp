#include <Eigen/Cholesky>
#include <Eigen/Geometry>
#include <cmath>
#include <optional>

#include "etalon/core/so3.h"
#include "etalon/core/stopwatch.h"
#include "etalon/initialization/initializer.h"
#include "etalon/initialization/steps/gravity_alignment.h"
#include "etalon/initialization/steps/linear_alignment.h"

namespace etalon::plugins {

using Eigen::Index;
using Eigen::Matrix3d;
using Eigen::MatrixXd;
using Eigen::Vector3d;
using Eigen::VectorXd;

/**
 * The visual-inertial alignment of VINS-Mono with the scale of a stereo camera (Qin et al., TRO
 * 2018), and what VINS-Fusion does in its place (README.md beside this file).
 */
class VinsAlignment : public Initializer {
  DEFINE_MRPT_OBJECT(VinsAlignment, etalon::plugins)

 public:
  void declareParameters(ParameterSet& parameters) override {
    parameters.add(
        "variant", &variant_, {{"alignment", Variant::kAlignment}, {"fusion", Variant::kFusion}},
        "alignment: velocities and gravity by linear alignment (VINS-Mono). fusion: what "
        "VINS-Fusion does with a stereo camera, gravity from the first accelerometer "
        "readings and velocities integrated from zero.");
    parameters.add("weights", &weights_,
                   {{"none", Weights::kNone},
                    {"imu", Weights::kImu},
                    {"imu_and_vision", Weights::kImuAndVision}},
                   "Weights of the alignment's rows: none (as published), by the covariance of the "
                   "preintegration, or by that and the covariance of stereo odometry.");
    parameters.add(
        "gyro_passes", &gyro_passes_, {1, 20},
        "Linear solutions for b_g, at most, each followed by integrating the raw IMU anew "
        "(as published: 1).");
    parameters.add(
        "gravity_iterations", &gravity_iterations_, {0, 100},
        "Iterations of gravity in the tangent plane of its sphere (VINS-Mono: 4); 0: the "
        "exact minimum on the sphere.");
    parameters.add(
        "max_gravity_deviation_mps2", &max_gravity_deviation_, {0.0, 100.0},
        "Refuse if gravity, left free, differs from its magnitude by more (VINS-Mono: 1), "
        "m/s^2.");
    parameters.add("min_landmarks", &min_landmarks_, {3, 100000},
                   "Refuse if stereo odometry has fewer landmarks in the window.");
  }
  bool needsVisualSolution() const override { return true; }

 protected:
  InitializationResult solve(const InitializationProblem& problem) const override {
    const Expected<VisualSolution>& found = problem.visualSolution();
    if (!found) return refuse(found.error());
    const VisualSolution& visual = *found;
    if (static_cast<int>(visual.landmarks.size()) < min_landmarks_)
      return refuse(RefusalStatus::kTooFewTracks, "stereo odometry has ",
                    Value(visual.landmarks.size()), " landmarks in the window, at least ",
                    Bound(min_landmarks_), " are wanted");
    Stopwatch watch;
    VisualFrameEstimate estimate;
    estimate.T_VB = visual.T_VB;
    estimate.landmarks = visual.landmarks;
    estimate.bias = problem.priors().mean;
    std::vector<Preintegration> preintegrations = problem.preintegrate(estimate.bias);
    MatrixXd gyro_bias_response;
    if (!estimateGyroBias(visual, &preintegrations, &estimate.bias, &gyro_bias_response))
      return refuse(RefusalStatus::kIllConditioned, "the rotations of ",
                    Value(problem.keyframeCount()), " keyframes do not determine the gyro bias");
    const double gyro_ms = watch.lapMilliseconds();

    if (variant_ == Variant::kFusion) {
      seedAsFusion(problem, preintegrations, &estimate);
    } else {
      estimate.errors = biasErrors(problem, visual, preintegrations, gyro_bias_response);
      const auto aligned = align(problem, visual, preintegrations, &estimate);
      if (!aligned) return refuse(aligned.error());
    }
    Initialization result = alignWithGravity(problem, estimate);
    result.timings = {{"gyro_bias", gyro_ms}, {"linear_alignment", watch.lapMilliseconds()}};
    return result;
  }

 private:
  enum class Variant { kAlignment, kFusion };
  enum class Weights { kNone, kImu, kImuAndVision };

  /**
   * b_g by least squares on the rotations of neighbouring keyframes, r_k = 2 vec(q) of
   * dR_k^T R_VBk^T R_VBk+1 = J_k db_g; preintegrations are integrated anew at the result.
   * @param response receives db_g/dr, 3 x 3(N-1)
   */
  bool estimateGyroBias(const VisualSolution& visual, std::vector<Preintegration>* preintegrations,
                        ImuBias* bias, MatrixXd* response) const {
    const Index rows = 3 * preintegrations->size();
    const MatrixXd whitening = rotationWhitening(visual, *preintegrations);
    for (int pass = 0; pass < gyro_passes_; ++pass) {
      MatrixXd J(rows, 3);
      VectorXd r(rows);
      for (size_t k = 0; k < preintegrations->size(); ++k) {
        const Preintegration& p = (*preintegrations)[k];
        const Matrix3d error =
            p.deltas().dR.transpose() * visual.T_VB[k].R.transpose() * visual.T_VB[k + 1].R;
        const Eigen::Quaterniond q(error);
        J.middleRows<3>(3 * k) = p.dR_dbg();
        r.segment<3>(3 * k) = (q.w() < 0 ? -2.0 : 2.0) * q.vec();
      }
      if (whitening.size() > 0) {
        J = whitening * J;
        r = whitening * r;
      }
      const Eigen::LDLT<Matrix3d> factor(J.transpose() * J);
      const Vector3d step = factor.solve(J.transpose() * r);
      *response = factor.solve(J.transpose());
      if (whitening.size() > 0) *response *= whitening;
      if (!factor.isPositive() || !step.allFinite()) return false;
      bias->gyro += step;
      for (Preintegration& p : *preintegrations) p = p.reintegrated(*bias);
      // The linear step leaves an error of the order of (|step| dt)^2 / dt.
      constexpr double kStandsStill = 1e-6;  // rad/s
      if (step.norm() < kStandsStill) break;
    }
    return true;
  }

  /** dr_k/d(poses) of all pairs, r_k near zero: 3(N-1) x 6(N-1). */
  static MatrixXd rotationByPoses(const VisualSolution& visual) {
    const Index n = visual.T_VB.size() - 1;
    MatrixXd J = MatrixXd::Zero(3 * n, 6 * n);
    for (Index k = 0; k < n; ++k) {
      J.block<3, 3>(3 * k, 6 * k).setIdentity();
      if (k > 0)
        J.block<3, 3>(3 * k, 6 * (k - 1)) = -visual.T_VB[k + 1].R.transpose() * visual.T_VB[k].R;
    }
    return J;
  }

  /** Errors of b_g, and of b_a, which stays at its prior's mean. The alignment adds the errors of
   * gravity and velocities. Nothing if stereo odometry has no covariance. */
  static std::optional<StateErrors> biasErrors(const InitializationProblem& problem,
                                               const VisualSolution& visual,
                                               const std::vector<Preintegration>& preintegrations,
                                               const MatrixXd& gyro_bias_response) {
    const Index n = preintegrations.size();
    if (visual.covariance.rows() != 6 * n) return {};
    StateErrors errors{ErrorSources(problem, preintegrations), {}};
    MatrixXd rotations = rotationByPoses(visual) * errors.sources.poses();
    const MatrixXd imu = errors.sources.imu();
    for (Index k = 0; k < n; ++k) rotations.middleRows<3>(3 * k) -= imu.middleRows<3>(9 * k);
    errors.map = errors.sources.priorMean();
    errors.map.topRows<3>() = gyro_bias_response * rotations;
    return errors;
  }

  /** W such that W^T W is the inverse covariance of all r_k; empty if all rows weigh the same. */
  MatrixXd rotationWhitening(const VisualSolution& visual,
                             const std::vector<Preintegration>& preintegrations) const {
    const Index n = preintegrations.size();
    if (weights_ == Weights::kNone) return {};
    MatrixXd covariance = MatrixXd::Zero(3 * n, 3 * n);
    if (weights_ == Weights::kImuAndVision && visual.covariance.rows() == 6 * n) {
      const MatrixXd J = rotationByPoses(visual);
      covariance = J * visual.covariance * J.transpose();
    }
    for (Index k = 0; k < n; ++k)
      covariance.block<3, 3>(3 * k, 3 * k) += preintegrations[k].covariance().topLeftCorner<3, 3>();
    const Eigen::LLT<MatrixXd> factor(covariance);
    if (factor.info() != Eigen::Success) return {};
    return factor.matrixL().solve(MatrixXd::Identity(3 * n, 3 * n));
  }

  /** Fills velocities and gravity. */
  Expected<void> align(const InitializationProblem& problem, const VisualSolution& visual,
                       const std::vector<Preintegration>& preintegrations,
                       VisualFrameEstimate* estimate) const {
    LinearAlignmentOptions options;
    options.gravity_mps2 = problem.gravityMagnitude();
    options.weighted = weights_ != Weights::kNone;
    if (weights_ == Weights::kImuAndVision) options.pose_covariance = visual.covariance;
    options.tangent_iterations = gravity_iterations_;
    const LinearAlignmentResult alignment =
        alignLinearly(visual.T_VB, preintegrations, estimate->bias, options);
    if (!alignment.summary.usable())
      return refuse(RefusalStatus::kIllConditioned, Value(problem.keyframeCount()),
                    " keyframes do not determine velocities and gravity");
    const double deviation = alignment.free_gravity_mps2 - problem.gravityMagnitude();
    if (!(std::abs(deviation) <= max_gravity_deviation_))
      return refuse(RefusalStatus::kImplausible, "gravity comes out ", deviation > 0.0 ? "+" : "",
                    Value(deviation, 2), " m/s^2 away from its magnitude, at most ",
                    Bound(max_gravity_deviation_, 2), " is wanted");
    estimate->v_VB = alignment.v_VB;
    estimate->g_V = alignment.g_V;
    if (estimate->errors &&
        !alignErrors(visual.T_VB, preintegrations, estimate->bias, options, alignment.g_V,
                     estimate->errors->sources.poses(), &*estimate->errors))
      estimate->errors.reset();
    return {};
  }

  /** Takes gravity from the mean specific force between the first two frames and integrates the
   * velocities from zero. */
  static void seedAsFusion(const InitializationProblem& problem,
                           const std::vector<Preintegration>& preintegrations,
                           VisualFrameEstimate* estimate) {
    const TimeNs start = problem.frames().front().t;
    Vector3d sum = Vector3d::Zero();
    for (const ImuSample& s : problem.imu().between(start, problem.frames()[1].t)) sum += s.accel;
    estimate->g_V = -problem.gravityMagnitude() * (estimate->T_VB.front().R * sum).normalized();
    estimate->v_VB.assign(1, Vector3d::Zero());
    for (size_t k = 0; k < preintegrations.size(); ++k)
      estimate->v_VB.emplace_back(estimate->v_VB[k] + estimate->g_V * preintegrations[k].dt() +
                                  estimate->T_VB[k].R * preintegrations[k].deltas().dv);
  }

  Variant variant_ = Variant::kAlignment;
  Weights weights_ = Weights::kImu;
  int gyro_passes_ = 3;
  int gravity_iterations_ = 4;
  double max_gravity_deviation_ = 1.0;
  int min_landmarks_ = 15;
};

IMPLEMENTS_MRPT_OBJECT(VinsAlignment, Initializer, etalon::plugins)

}  // namespace etalon::plugins

ETALON_REGISTER_INITIALIZER(VinsAlignment, etalon::plugins, "vins_alignment", "1.0",
                            "gyro bias from rotations, linear alignment of velocities and gravity "
                            "(Qin et al. 2018)")
