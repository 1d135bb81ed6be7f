#include "etalon/initialization/steps/time_offset_of_rotations.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <numeric>

#include "etalon/core/angles.h"
#include "etalon/core/so3.h"
#include "etalon/core/text.h"
#include "etalon/initialization/steps/gyro_bias_of_rotations.h"

namespace etalon {

using Eigen::Index;
using Eigen::Matrix3d;
using Eigen::MatrixXd;
using Eigen::Vector3d;
using Eigen::VectorXd;

namespace {

constexpr double kSigmaCameraRotation = radians(0.5);
constexpr double kSignificant = 6.0;   // standard deviations
constexpr double kTolerated = 2e-3;    // s
constexpr double kFits = 10.0;         // chi2 a degree of freedom
constexpr double kFarthest = 0.1;      // s
constexpr double kStandsStill = 1e-5;  // s
constexpr int kPasses = 20, kFewestPairs = 5;
enum Column : Index { kBias = 0, kCamera = 3, kOffset = 6, kColumns = 7 };
using Vector7d = Eigen::Matrix<double, kColumns, 1>;
using Matrix7d = Eigen::Matrix<double, kColumns, kColumns>;

/** Of the pairs, one below the other. */
struct Rows {
  Eigen::Matrix<double, Eigen::Dynamic, kColumns> J;  ///< of what is predicted
  VectorXd r;
  MatrixXd covariance;
};

/** @param pairs those to use; the ones whose shifted interval the IMU does not cover are taken out,
 * for good, because a sum over other pairs from step to step would not converge */
Rows rowsAt(const Vector7d& x, const InitializationProblem& problem, const VisualSolution& visual,
            const MatrixXd& visual_covariance, std::vector<Index>* pairs) {
  const ImuBias bias{problem.priors().mean.gyro + x.segment<3>(kBias), problem.priors().mean.accel};
  const Matrix3d turned = expSO3(x.segment<3>(kCamera));
  const TimeNs shift = durationNs(x[kOffset]);
  Rows rows;
  rows.J.resize(3 * pairs->size(), kColumns);
  rows.r.resize(3 * pairs->size());
  std::vector<Index> used;
  std::vector<Matrix3d> noise;
  for (const Index k : *pairs) {
    std::vector<ImuSample> samples =
        problem.imu().between(problem.keyframe(k).t + shift, problem.keyframe(k + 1).t + shift);
    if (samples.empty()) continue;
    const Preintegration p(std::move(samples), bias, problem.imuNoise());
    const Index row = 3 * used.size();
    const Matrix3d dR = turned.transpose() * p.deltas().dR * turned;
    const auto rate = [&](const ImuSample& sample) -> Vector3d {
      return turned.transpose() * (sample.gyro - bias.gyro);
    };
    rows.J.middleRows<3>(row) << turned.transpose() * p.dR_dbg(),
        Matrix3d::Identity() - dR.transpose(),
        rate(p.samples().back()) - dR.transpose() * rate(p.samples().front());
    rows.r.segment<3>(row) =
        logSO3(dR.transpose() * visual.T_VB[k].R.transpose() * visual.T_VB[k + 1].R);
    noise.push_back(p.covariance().topLeftCorner<3, 3>());
    used.push_back(k);
  }
  const Index n = used.size();
  rows.J.conservativeResize(3 * n, Eigen::NoChange);
  rows.r.conservativeResize(3 * n);
  rows.covariance.resize(3 * n, 3 * n);
  for (Index i = 0; i < n; ++i)
    for (Index j = 0; j < n; ++j)
      rows.covariance.block<3, 3>(3 * i, 3 * j) =
          visual_covariance.block<3, 3>(3 * used[i], 3 * used[j]);
  for (Index i = 0; i < n; ++i) rows.covariance.block<3, 3>(3 * i, 3 * i) += noise[i];
  *pairs = std::move(used);
  return rows;
}

}  // namespace

bool RotationTimeOffset::certain() const {
  return chi2_per_dof < kFits && std::abs(offset_s) > std::max(kTolerated, kSignificant * sigma_s);
}

std::string RotationTimeOffset::inWords() const {
  return format("the stamps of the images are %.1f ms (+- %.1f) too %s", 1e3 * std::abs(offset_s),
                1e3 * sigma_s, offset_s < 0.0 ? "late" : "early");
}

Expected<RotationTimeOffset> timeOffsetOfRotations(const InitializationProblem& problem,
                                                   const VisualSolution& visual) {
  const MatrixXd visual_covariance = covarianceOfRotations(visual);
  Vector7d weight = Vector7d::Zero();  // of the priors
  weight.segment<3>(kBias).setConstant(std::pow(problem.priors().sigma_gyro_rps, -2));
  weight.segment<3>(kCamera).setConstant(std::pow(kSigmaCameraRotation, -2));
  Vector7d x = Vector7d::Zero();
  std::vector<Index> pairs(std::max(0, problem.keyframeCount() - 1));
  std::iota(pairs.begin(), pairs.end(), 0);
  for (int pass = 0; pass < kPasses; ++pass) {
    const Rows rows = rowsAt(x, problem, visual, visual_covariance, &pairs);
    RotationTimeOffset result;
    result.pairs = pairs.size();
    if (result.pairs < kFewestPairs)
      return refuse(RefusalStatus::kTooFewKeyframes, "the IMU covers ", Value(result.pairs),
                    " pairs of keyframes, at least ", Bound(kFewestPairs), " are wanted");
    const Eigen::LLT<MatrixXd> whitening(rows.covariance);
    const MatrixXd J = whitening.matrixL().solve(rows.J);
    const VectorXd r = whitening.matrixL().solve(rows.r);
    const Matrix7d H = J.transpose() * J + Matrix7d(weight.asDiagonal());
    const Eigen::LLT<Matrix7d> factor(H);
    const Vector7d step = factor.solve(J.transpose() * r - weight.cwiseProduct(x));
    if (whitening.info() != Eigen::Success || factor.info() != Eigen::Success || !step.allFinite())
      return refuse(RefusalStatus::kIllConditioned, "the rotations of ",
                    Value(problem.keyframeCount()), " keyframes do not determine the time offset");
    x += step;
    if (!(std::abs(x[kOffset]) < kFarthest))
      return refuse(RefusalStatus::kImplausible, "the time offset would be ", Value(x[kOffset], 3),
                    " s, at most ", Bound(kFarthest, 3), " is looked for");
    if (std::abs(step[kOffset]) > kStandsStill) continue;
    // Of the bias, the rotation of the cameras (which is nearly its prior), and the offset.
    const Index dof = rows.r.size() - 4;
    const double chi2 = r.squaredNorm() + weight.dot((x - step).cwiseAbs2());
    result.chi2_per_dof = chi2 / static_cast<double>(dof);
    const Matrix7d P = factor.solve(Matrix7d::Identity());
    result.offset_s = x[kOffset];
    result.sigma_s = std::sqrt(P(kOffset, kOffset) * std::max(1.0, result.chi2_per_dof));
    return result;
  }
  return refuse(RefusalStatus::kNotConverged, "the time offset still moves after ", Value(kPasses),
                " steps");
}

}  // namespace etalon
