#pragma once

// Normal equations of the window's pixels, landmarks eliminated. Private to the module.

#include <cmath>

#include "window.h"

namespace etalon::fixed_lag {

/** Gauss-Newton's equations H x = -g of the cost x^T H x + 2 g^T x + cost. */
struct NormalEquations {
  Eigen::MatrixXd H;
  Eigen::VectorXd g;
  double cost = 0.0;  ///< robust sum of squares

  explicit NormalEquations(Eigen::Index size)
      : H(Eigen::MatrixXd::Zero(size, size)), g(Eigen::VectorXd::Zero(size)) {}
};

/** Squared scale of the Cauchy loss: of a pixel's two whitened coordinates. */
constexpr double kLossChi2 = 4.0;
/**
 * With Gaussian noise (s = r^2 exponential of mean 2, w = 1 / (1 + s / kLossChi2)) Gauss-Newton's
 * matrix has E[w] = 0.723 of the information, and the estimate's variance is E[w^2 s] / 2 / (E[w] -
 * E[w^2 s] / kLossChi2)^2 = 1.092 of the least: the loss is scaled by 1 / (0.723 * 1.092), so that
 * the covariance is the one that the estimate has.
 */
constexpr double kLossGain = 1.267;

/** The robust cost of squared whitened residuals, kLossGain kLossChi2 log(1 + r^2 / kLossChi2)
 * each; one logarithm for many. */
class RobustCost {
 public:
  /** @return the weight of the residual */
  double add(double r2) {
    const double factor = 1.0 + r2 / kLossChi2;
    product_ *= factor;
    if (product_ > 1e100) flush();
    return kLossGain / factor;
  }
  double total() {
    flush();
    return kLossGain * kLossChi2 * sum_;
  }

 private:
  void flush() {
    sum_ += std::log(product_);
    product_ = 1.0;
  }
  double product_ = 1.0, sum_ = 0.0;
};

/**
 * The pixels' part of the cost, around the window's estimates. A residual depends on the pose of
 * the observing body in the host's alone: its derivative by that is taken at the estimates, and
 * that of the relative pose by the two absolute ones at the linearisation points, so that moving
 * and turning all states together costs nothing whatever those are. Landmarks with the same host
 * share the second factor, which is applied once for all of them.
 */
class VisualTerms {
 public:
  /**
   * Adds those of `landmarks` to the equations; keeps what solveLandmarks() needs, and sets
   * the landmarks' covariances.
   * @param last_state observations in later states are left out
   * @param calibration whether the columns of the calibration are wanted, too; without them it is
   *        held
   */
  void linearize(const Window& window, const std::vector<Landmark*>& landmarks, int last_state,
                 NormalEquations* equations, bool calibration = false);

  /** Moves the landmarks of the last linearize() to their best places for the step of the states
   * (and, if that had its columns, of the calibration); inverse distances stay at 0 or above. */
  void solveLandmarks(const Window& window, const Eigen::VectorXd& step) const;

  /** The robust cost alone, of all landmarks. */
  double cost(const Window& window, const std::vector<Landmark*>& landmarks) const;

 private:
  using Matrix6d = Eigen::Matrix<double, 6, 6>;
  using Vector6d = Eigen::Matrix<double, 6, 1>;
  using Matrix63d = Eigen::Matrix<double, 6, 3>;

  /** An observing state of a landmark, other than the host. */
  struct Target {
    int state = 0;
    Matrix6d H_pp;
    Matrix63d H_pl, scaled;
    Vector6d g_p;
  };
  /** A landmark of the last linearisation. */
  struct Eliminated {
    Landmark* landmark = nullptr;
    Eigen::Matrix3d inverse;
    Eigen::Vector3d g_l;
    size_t first = 0, last = 0;  ///< of targets_
  };
  /** Sums in relative poses over the landmarks of a host. */
  class HostSums {
   public:
    /** None; @param states of the window */
    void clear(size_t states);
    bool used() const { return !seen_.empty(); }
    /** Makes the sums of a state, if it has none. */
    void see(int state);
    /** The states that have sums, in the order of see(). */
    const std::vector<int>& seen() const { return seen_; }
    /** Of two of them, `row` not after `column`. */
    Matrix6d& H(int row, int column) { return H_[column * (column + 1) / 2 + row]; }
    const Matrix6d& H(int row, int column) const { return H_[column * (column + 1) / 2 + row]; }
    Vector6d& g(int state) { return g_[state]; }
    const Vector6d& g(int state) const { return g_[state]; }

   private:
    std::vector<int> seen_;
    std::vector<char> is_seen_;
    std::vector<Matrix6d> H_;
    std::vector<Vector6d> g_;
  };

  using Matrix6Cd = Eigen::Matrix<double, 6, kCalibrationSize>;
  using MatrixC3d = Eigen::Matrix<double, kCalibrationSize, 3>;
  /** What the columns of the calibration have with all others. The time offset is a motion of the
   * relative poses and comes in with these. */
  struct CalibrationSums {
    Eigen::Matrix<double, kCalibrationSize, kCalibrationSize> H;
    CalibrationVector g;
    std::vector<MatrixC3d> H_cl;    ///< by landmark, as eliminated_
    std::vector<Matrix6Cd> H_host;  ///< sums in relative poses, by host and state
    CalibrationDerivatives derivatives;
    /** The residuals of the landmark in hand. */
    struct Row {
      int target = -1;  ///< its state; -1: the host
      double weight = 0.0;
      Eigen::Vector2d r;
      Eigen::Matrix<double, 2, 6> J_pose;
      Eigen::Matrix<double, 2, 3> J_landmark;
      CalibrationJacobian J;
    };
    std::vector<Row> rows;
  };

  void addResidual(const Window& window, const ReprojectionMeasurement& measurement, int camera,
                   const Landmark& landmark, const SE3& T_HT, Target* target, Eigen::Matrix3d* V,
                   Eigen::Vector3d* g_l);
  void eliminateFromCalibration(const Eigen::Vector3d& damping);
  void beginCalibration(const Window& window);
  void calibrationToAbsolute(const Window& window, int host, NormalEquations* equations);
  void finishCalibration(NormalEquations* equations) const;
  void collect(const Window& window, Landmark* landmark, int last_state);
  void eliminate(const Eliminated& eliminated);
  void toAbsolute(const Window& window, int host, NormalEquations* equations) const;

  RobustCost cost_;  ///< of the linearisation
  std::vector<Target> targets_;
  std::vector<Eliminated> eliminated_;
  std::vector<HostSums> hosts_;
  std::vector<SE3> relative_;  ///< T_HT by host and target, at the estimates
  bool with_calibration_ = false;
  CalibrationSums calibration_;
};

/** Derivatives of the pose of the target in the host, [rotation by right perturbation, position in
 * the host], by the two absolute ones. */
struct RelativeJacobians {
  Eigen::Matrix<double, 6, 6> by_target, by_host;
};
RelativeJacobians relativeJacobians(const SE3& T_WH, const SE3& T_WT);
/** The same of where the images of two states were taken, by the states' poses, at the linearisation
 * points. */
RelativeJacobians imageJacobians(const WindowState& host, const WindowState& target);
/** And by the time offset. */
Eigen::Matrix<double, 6, 1> byTimeOffset(const WindowState& host, const WindowState& target);

}  // namespace etalon::fixed_lag
