#include "etalon/initialization/steps/translation_ba.h"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>

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
  TranslationSolver(const VisualWindow& window, const TranslationBaOptions& options,
                    const std::vector<char>& landmark_valid, TranslationBaResult* result)
      : window_(window), options_(options), valid_(landmark_valid), result_(*result) {}

  /** One step; false if the system is singular. `*step_norm` receives the largest translation step,
   * m. */
  bool step(bool robust, double* step_norm) {
    linearize(robust);
    const Eigen::Index n = 3 * (window_.keyframe_count - 1);
    Eigen::MatrixXd H = Eigen::MatrixXd::Zero(n + 3, n + 3);
    Eigen::VectorXd b = Eigen::VectorXd::Zero(n + 3);
    for (int l = 0; l < window_.landmarkCount(); ++l) addToReducedSystem(l, &H, &b);
    const Eigen::LDLT<Eigen::MatrixXd> factor(H.bottomRightCorner(n, n));
    Eigen::VectorXd dt = Eigen::VectorXd::Zero(n + 3);
    dt.tail(n) = factor.solve(b.tail(n));
    if (!factor.isPositive() || !(factor.rcond() > 1e-15) || !dt.allFinite()) return false;
    for (int k = 1; k < window_.keyframe_count; ++k)
      result_.T_VB[static_cast<size_t>(k)].t += dt.segment<3>(3 * k);
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
      const size_t l = static_cast<size_t>(landmark);
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
    std::vector<int> per_keyframe(static_cast<size_t>(window_.keyframe_count), 0);
    for (size_t i = 0; i < window_.measurements.size(); ++i) {
      const VisualMeasurement& m = window_.measurements[i];
      Eigen::Vector2d r;
      const bool inlier = valid_[static_cast<size_t>(m.landmark)] && residual(m, &r, nullptr) &&
                          r.squaredNorm() < options_.chi2_threshold;
      result_.inlier[i] = inlier;
      if (!inlier) continue;
      sum += r.squaredNorm();
      ++result_.inliers;
      ++per_keyframe[static_cast<size_t>(m.keyframe)];
    }
    result_.rms_px_over_sigma = result_.inliers ? std::sqrt(sum / (2.0 * result_.inliers)) : 0.0;
    result_.fewest_inliers = *std::min_element(per_keyframe.begin() + 1, per_keyframe.end());
  }

 private:
  bool residual(const VisualMeasurement& m, Eigen::Vector2d* r, Eigen::Matrix<double, 2, 3>* J,
                Eigen::Matrix<double, 2, 6>* J_pose = nullptr) const {
    return reprojectionResidual(window_.T_CB[static_cast<size_t>(m.camera)], m.measurement,
                                result_.T_VB[static_cast<size_t>(m.keyframe)],
                                result_.landmarks[static_cast<size_t>(m.landmark)], r, J_pose, J);
  }

  void linearize(bool robust) {
    const double huber = std::sqrt(options_.chi2_threshold);
    contributions_.clear();
    first_.assign(1, 0);
    for (int l = 0; l < window_.landmarkCount(); ++l) {
      int current = -1;
      for (int i = window_.first[static_cast<size_t>(l)];
           i < window_.first[static_cast<size_t>(l) + 1]; ++i) {
        const VisualMeasurement& m = window_.measurements[static_cast<size_t>(i)];
        Eigen::Vector2d r;
        Eigen::Matrix<double, 2, 3> J;
        Eigen::Matrix<double, 2, 6> J_pose;
        if (!result_.inlier[static_cast<size_t>(i)] || !residual(m, &r, &J, &J_pose)) continue;
        if (m.keyframe != current) {
          contributions_.push_back({});
          contributions_.back().keyframe = current = m.keyframe;
        }
        const double norm = r.norm();
        const double weight = robust && norm > huber ? huber / norm : 1.0;
        contributions_.back().A.noalias() += weight * J.transpose() * J;
        contributions_.back().a.noalias() += weight * J.transpose() * r;
        contributions_.back().B.noalias() += weight * J.transpose() * J_pose.leftCols<3>();
      }
      first_.push_back(contributions_.size());
    }
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
    const size_t l = static_cast<size_t>(landmark);
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
      result_.landmarks[l] += V_inv * rhs;
    }
  }

  const VisualWindow& window_;
  const TranslationBaOptions& options_;
  const std::vector<char>& valid_;
  TranslationBaResult& result_;
  std::vector<Contribution> contributions_;
  std::vector<size_t> first_;  ///< contributions of landmark l: [first_[l], first_[l + 1])
};

}  // namespace

TranslationBaResult solveTranslationBa(const VisualWindow& window, const std::vector<SE3>& T_VB,
                                       const std::vector<Eigen::Vector3d>& landmarks,
                                       const std::vector<char>& landmark_valid,
                                       const TranslationBaOptions& options) {
  TranslationBaResult result;
  result.T_VB = T_VB;
  result.landmarks = landmarks;
  result.inlier.assign(window.measurements.size(), 0);
  for (size_t i = 0; i < window.measurements.size(); ++i)
    result.inlier[i] = landmark_valid[static_cast<size_t>(window.measurements[i].landmark)];
  if (window.keyframe_count < 2) return result;

  TranslationSolver solver(window, options, landmark_valid, &result);
  constexpr double kConvergedStep = 1e-7;  // m
  for (int round = 0; round < options.rounds; ++round) {
    const bool robust = round + 1 < options.rounds;
    for (int iteration = 0; iteration < options.iterations_per_round; ++iteration) {
      double step_norm = 0.0;
      if (!solver.step(robust, &step_norm)) return result;
      ++result.iterations;
      if (step_norm < kConvergedStep) break;
    }
    if (!robust) solver.fillResponse();
    solver.relabel();
  }
  result.ok = true;
  return result;
}

}  // namespace etalon
