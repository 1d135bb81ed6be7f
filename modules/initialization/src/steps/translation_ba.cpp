#include "etalon/initialization/steps/translation_ba.h"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>

#include "etalon/optimization/bundle/normal_equations.h"
#include "etalon/optimization/residuals/huber.h"

namespace etalon {

namespace {

/** What one keyframe's measurements of one landmark contribute: sums of w J^T J and w J^T r, J =
 * d(r)/d(p_W). */
struct Contribution {
  int keyframe = 0;
  Eigen::Matrix3d A = Eigen::Matrix3d::Zero();
  Eigen::Vector3d a = Eigen::Vector3d::Zero();
  Eigen::Matrix3d B = Eigen::Matrix3d::Zero();  ///< sum of w J^T d(r)/d(rotation)
};

/** Gauss-Newton on the translations; the landmarks, if free, are eliminated. */
class TranslationSolver {
 public:
  TranslationSolver(const TranslationBaOptions& options, TranslationBaResult* result)
      : window_(result->bundle.window), options_(options), result_(*result) {}

  /** One step; false if the system is singular. `*step_norm` receives the largest translation step,
   * m. */
  bool step(bool robust, double* step_norm) {
    linearize(robust);
    const Eigen::Index n = 3 * (window_.keyframe_count - 1);
    Eigen::MatrixXd H = Eigen::MatrixXd::Zero(n + 3, n + 3);
    Eigen::VectorXd b = Eigen::VectorXd::Zero(n + 3);
    for (int l = 0; l < window_.landmarkCount(); ++l) addToReducedSystem(l, &H, &b);
    const ScaledCholesky factor(H.bottomRightCorner(n, n));
    if (!factor.determined()) return false;
    Eigen::VectorXd dt = Eigen::VectorXd::Zero(n + 3);
    dt.tail(n) = factor.solve(b.tail(n));
    if (!dt.allFinite()) return false;
    for (int k = 1; k < window_.keyframe_count; ++k) result_.T_VB[k].t += dt.segment<3>(3 * k);
    if (options_.landmarks_free) moveLandmarks(dt);
    *step_norm = dt.lpNorm<Eigen::Infinity>();
    return true;
  }

  /** TranslationBaResult::position_by_rotation at the system that step() has solved last. */
  void fillResponse() {
    const Eigen::Index n = 3 * (window_.keyframe_count - 1);
    Eigen::MatrixXd H = Eigen::MatrixXd::Zero(n + 3, n + 3), B = H;
    Eigen::VectorXd b = Eigen::VectorXd::Zero(n + 3);
    for (int landmark = 0; landmark < window_.landmarkCount(); ++landmark) {
      addToReducedSystem(landmark, &H, &b);
      const size_t l = landmark;
      Eigen::Vector3d e;
      const Eigen::Matrix3d V_inv =
          options_.landmarks_free ? landmarkCovariance(l, &e) : Eigen::Matrix3d::Zero();
      for (size_t i = first_[l]; i < first_[l + 1]; ++i) {
        const Contribution& ci = contributions_[i];
        B.block<3, 3>(3 * ci.keyframe, 3 * ci.keyframe) += ci.B;
        if (!options_.landmarks_free) continue;
        for (size_t j = first_[l]; j < first_[l + 1]; ++j)
          B.block<3, 3>(3 * ci.keyframe, 3 * contributions_[j].keyframe) -=
              ci.A * V_inv * contributions_[j].B;
      }
    }
    result_.position_by_rotation =
        H.bottomRightCorner(n, n).ldlt().solve(B.bottomRightCorner(n, n));
  }

  /** Chi-square relabelling of every measurement of a valid landmark. */
  void relabel() {
    double sum = 0.0;
    result_.inliers = 0;
    std::vector<int> per_keyframe(window_.keyframe_count, 0);
    for (VisualMeasurement& m : window_.measurements) {
      Eigen::Vector2d r;
      m.inlier = landmark(m).known && residual(m, &r, nullptr) &&
                 r.squaredNorm() < options_.chi2_threshold;
      if (!m.inlier) continue;
      sum += r.squaredNorm();
      ++result_.inliers;
      ++per_keyframe[m.keyframe];
    }
    result_.summary.final_cost = 0.5 * sum;
    result_.rms_px_over_sigma = result_.inliers ? std::sqrt(sum / (2.0 * result_.inliers)) : 0.0;
    result_.fewest_inliers = *std::min_element(per_keyframe.begin() + 1, per_keyframe.end());
  }

 private:
  const BundleLandmark& landmark(const VisualMeasurement& m) const {
    return result_.bundle.landmarks[m.landmark];
  }

  bool residual(const VisualMeasurement& m, Eigen::Vector2d* r, Eigen::Matrix<double, 2, 3>* J,
                Eigen::Matrix<double, 2, 6>* J_pose = nullptr) const {
    return window_.residual(m, result_.T_VB, landmark(m).position, r, J_pose, J);
  }

  void linearize(bool robust) {
    const double huber =
        robust ? std::sqrt(options_.chi2_threshold) : std::numeric_limits<double>::infinity();
    double cost = 0.0;
    contributions_.clear();
    first_.assign(1, 0);
    for (int l = 0; l < window_.landmarkCount(); ++l) {
      int current = -1;
      for (const VisualMeasurement& m : window_.measurementsOf(l)) {
        Eigen::Vector2d r;
        Eigen::Matrix<double, 2, 3> J;
        Eigen::Matrix<double, 2, 6> J_pose;
        if (!m.inlier || !residual(m, &r, &J, &J_pose)) continue;
        if (m.keyframe != current) {
          contributions_.push_back({});
          contributions_.back().keyframe = current = m.keyframe;
        }
        const double norm = r.norm(), weight = huberWeight(norm, huber);
        cost += huberLoss(norm, huber);
        contributions_.back().A.noalias() += weight * J.transpose() * J;
        contributions_.back().a.noalias() += weight * J.transpose() * r;
        contributions_.back().B.noalias() += weight * J.transpose() * J_pose.leftCols<3>();
      }
      first_.push_back(contributions_.size());
    }
    if (result_.summary.iterations++ == 0) result_.summary.initial_cost = cost;
  }

  /** Information of landmark `l`, inverted; slightly damped so that one at great distance stays
   * invertible. */
  Eigen::Matrix3d landmarkCovariance(size_t l, Eigen::Vector3d* gradient) const {
    Eigen::Matrix3d V = Eigen::Matrix3d::Zero();
    gradient->setZero();
    for (size_t i = first_[l]; i < first_[l + 1]; ++i) {
      V += contributions_[i].A;
      *gradient += contributions_[i].a;
    }
    V.diagonal().array() += 1e-9 * V.trace() + 1e-12;
    return V.inverse();
  }

  // d(r)/d(translation) = -J: the gradient with respect to a translation is -a, its right-hand side
  // +a.
  void addToReducedSystem(int landmark, Eigen::MatrixXd* H, Eigen::VectorXd* b) const {
    const size_t l = landmark;
    for (size_t i = first_[l]; i < first_[l + 1]; ++i) {
      const Contribution& c = contributions_[i];
      H->block<3, 3>(3 * c.keyframe, 3 * c.keyframe) += c.A;
      b->segment<3>(3 * c.keyframe) += c.a;
    }
    if (!options_.landmarks_free) return;
    Eigen::Vector3d e;
    const Eigen::Matrix3d V_inv = landmarkCovariance(l, &e);
    for (size_t i = first_[l]; i < first_[l + 1]; ++i) {
      const Contribution& ci = contributions_[i];
      const Eigen::Matrix3d A_V = ci.A * V_inv;
      b->segment<3>(3 * ci.keyframe) -= A_V * e;
      for (size_t j = first_[l]; j < first_[l + 1]; ++j) {
        const Contribution& cj = contributions_[j];
        H->block<3, 3>(3 * ci.keyframe, 3 * cj.keyframe).noalias() -= A_V * cj.A;
      }
    }
  }

  void moveLandmarks(const Eigen::VectorXd& dt) {
    for (size_t l = 0; l + 1 < first_.size(); ++l) {
      if (first_[l] == first_[l + 1]) continue;
      Eigen::Vector3d e;
      const Eigen::Matrix3d V_inv = landmarkCovariance(l, &e);
      Eigen::Vector3d rhs = -e;
      for (size_t i = first_[l]; i < first_[l + 1]; ++i)
        rhs += contributions_[i].A * dt.segment<3>(3 * contributions_[i].keyframe);
      result_.bundle.landmarks[l].position += V_inv * rhs;
    }
  }

  VisualWindow& window_;
  const TranslationBaOptions& options_;
  TranslationBaResult& result_;
  std::vector<Contribution> contributions_;
  std::vector<size_t> first_;  ///< contributions of landmark l: [first_[l], first_[l + 1])
};

}  // namespace

TranslationBaResult solveTranslationBa(BundleProblem bundle, const std::vector<SE3>& T_VB,
                                       const TranslationBaOptions& options) {
  TranslationBaResult result;
  result.bundle = std::move(bundle);
  result.T_VB = T_VB;
  for (VisualMeasurement& m : result.bundle.window.measurements)
    m.inlier = result.bundle.landmarks[m.landmark].known;
  if (result.bundle.window.keyframe_count < 2) {
    result.summary.stop(Termination::kNotStarted, "one keyframe has nothing to translate");
    return result;
  }

  TranslationSolver solver(options, &result);
  constexpr double kConvergedStep = 1e-7;  // m
  for (int round = 0; round < options.rounds; ++round) {
    const bool robust = round + 1 < options.rounds;
    result.summary.termination = Termination::kMaxIterations;
    for (int iteration = 0; iteration < options.iterations_per_round; ++iteration) {
      double step_norm = 0.0;
      if (!solver.step(robust, &step_norm)) {
        result.summary.stop(Termination::kSingular,
                            "the landmarks do not determine the translations");
        return result;
      }
      if (step_norm >= kConvergedStep) continue;
      result.summary.termination = Termination::kConverged;
      break;
    }
    if (!robust) solver.fillResponse();
    solver.relabel();
  }
  return result;
}

}  // namespace etalon
