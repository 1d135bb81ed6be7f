#pragma once

// Normal equations of the window's pixels, landmarks eliminated. Private to the module.

#include <cmath>

#include "etalon/optimization/residuals/cauchy.h"
#include "relative_views.h"

namespace etalon::fixed_lag {

/** Gauss-Newton's equations H x = -g of the cost x^T H x + 2 g^T x + cost. */
struct NormalEquations {
  Eigen::MatrixXd H;  ///< empty where the gradient alone is wanted
  Eigen::VectorXd g;
  double cost = 0.0;  ///< robust sum of squares

  explicit NormalEquations(Eigen::Index size)
      : H(Eigen::MatrixXd::Zero(size, size)), g(Eigen::VectorXd::Zero(size)) {}
  static NormalEquations gradientOf(Eigen::Index size) {
    NormalEquations equations(0);
    equations.g.setZero(size);
    return equations;
  }
};

/** The robust cost of squared whitened residuals, kCauchyGain kCauchyChi2 log(1 + r^2 / kCauchyChi2)
 * each; one logarithm for many. */
class RobustCost {
 public:
  /** @return the weight of the residual */
  double add(double r2) {
    const double factor = 1.0 + r2 / kCauchyChi2;
    product_ *= factor;
    if (product_ > 1e100) flush();
    return kCauchyGain / factor;
  }
  double total() {
    flush();
    return kCauchyGain * kCauchyChi2 * sum_;
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
 * the observing body in the host's alone. Unknowns are counted as twists: state k, and all that is
 * rigid with it, turns and moves by eta_k = [rotation; translation of the point at the centre N],
 * in axes of W. The residuals of a landmark of host h then depend on eta_k - eta_h, by a factor
 * that is the landmark's own, G = [hat(y), -rho I] with y = rho (its position from N): a residual
 * needs its derivatives by the three coordinates of y alone. Residuals are linearised at the
 * estimates, G and the twists by the states at the linearisation points, so that moving and turning
 * all states together costs nothing whatever those are.
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

  /**
   * Adds gradient and cost of the landmarks of the last linearize(), of all their observations, at
   * the present estimates; what eliminates the landmarks is still that linearisation's.
   */
  void updateGradient(const Window& window, NormalEquations* equations);

  /** Moves the landmarks of the last linearize() to their best places for the step of the states
   * (and, if that had its columns, of the calibration); inverse distances stay at 0 or above. */
  void solveLandmarks(const Window& window, const Eigen::VectorXd& step) const;

  /** The robust cost alone, of all landmarks. */
  double cost(const Window& window, const std::vector<Landmark*>& landmarks) const;

 private:
  using Matrix6d = Eigen::Matrix<double, 6, 6>;
  using Vector6d = Eigen::Matrix<double, 6, 1>;

  /** An observing state of a landmark, other than the host: sums over its cameras, J being the
   * derivatives by y and J_l those by the landmark's parameters. */
  struct Target {
    int state = 0;
    Eigen::Matrix3d JJ, JJ_l;
    Eigen::Vector3d Jr;
  };
  /** A landmark of the last linearisation. */
  struct Eliminated {
    Landmark* landmark = nullptr;
    Eigen::Vector3d y;       ///< of G
    double rho = 0.0;        ///< of G
    Eigen::Matrix3d factor;  ///< upper triangular; factor factor^T is the inverse of its block
    Eigen::Vector3d g_l;
    bool held = false;           ///< at infinity: its distance is no unknown
    size_t first = 0, last = 0;  ///< of targets_
  };
  /** A residual, and what it is differentiated by. */
  struct Pixel {
    Eigen::Vector2d r;
    Eigen::Matrix<double, 3, 2> J_T;  ///< by y, transposed
    Eigen::Vector2d by_rho;
    double weight = 0.0;
  };

  using Matrix6Cd = Eigen::Matrix<double, 6, kCalibrationSize>;
  using MatrixC3d = Eigen::Matrix<double, kCalibrationSize, 3>;
  /** What the columns of the calibration have with all others. The time offset moves the states'
   * images and comes in with the twists. */
  struct CalibrationSums {
    Eigen::Matrix<double, kCalibrationSize, kCalibrationSize> H;
    CalibrationVector g;
    std::vector<MatrixC3d> H_cl;      ///< by landmark, as eliminated_
    std::vector<Matrix6Cd> by_twist;  ///< by state
    CalibrationDerivatives derivatives;
    /** The residuals of the landmark in hand. */
    struct Row {
      int state = -1;  ///< that observes
      double weight = 0.0;
      Eigen::Vector2d r;
      Eigen::Matrix<double, 2, 3> J, J_landmark;
      CalibrationJacobian J_calibration;
    };
    std::vector<Row> rows;
  };

  void placeViews(const Window& window);
  inline bool pixelAt(const Window& window, const RelativeViews::Ray& ray, int host,
                      const LandmarkObservation& o, size_t camera, Pixel* pixel);
  void collect(const Window& window, Landmark* landmark, int last_state);
  void collectGradient(const Window& window, Eliminated* e);
  void eliminate(int host, size_t first);
  void addToStates(const Window& window, NormalEquations* equations) const;
  Eigen::VectorXd twistsByTimeOffset(const Window& window) const;
  void beginCalibration(const Window& window);
  void eliminateFromCalibration(const Eigen::Vector3d& damping);
  void addCalibration(const Window& window, NormalEquations* equations);

  RobustCost cost_;  ///< of the linearisation
  std::vector<Target> targets_;
  std::vector<Eliminated> eliminated_;                  ///< by host
  Eigen::Vector3d centre_W_ = Eigen::Vector3d::Zero();  ///< N
  std::vector<SE3> T_NI_;  ///< where images were taken, by state, at the linearisation points
  RelativeViews views_;
  Eigen::MatrixXd H_;  ///< of the twists, all of them
  Eigen::VectorXd g_;
  std::vector<char> used_;  ///< by state: has a twist with pixels
  bool with_calibration_ = false;
  CalibrationSums calibration_;
};

/** Derivative of a state's twist about `centre_W` by its error [rotation, position], at the
 * linearisation point; the same of its body and of its image. */
Eigen::Matrix<double, 6, 6> twistByState(const WindowState& state, const Eigen::Vector3d& centre_W);

}  // namespace etalon::fixed_lag
