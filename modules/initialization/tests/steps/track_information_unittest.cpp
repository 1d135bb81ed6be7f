#include "etalon/initialization/steps/track_information.h"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <Eigen/Geometry>
#include <Eigen/LU>

#include "etalon/core/so3.h"
#include "etalon/core/symmetric.h"
#include "etalon/testing/expect_jacobian.h"
#include "etalon/testing/synthetic_window.h"

namespace etalon {
namespace {

using Eigen::Index;
using Eigen::Matrix3d;
using Eigen::MatrixXd;
using Eigen::Vector2d;
using Eigen::Vector3d;
using Eigen::VectorXd;
using testing::Motion;
using testing::SyntheticWindowOptions;

constexpr double kLargestChi2 = 16.0;
constexpr double kNotRobust = 1e6;  // sigmas: every weight is one

struct InformationCase {
  explicit InformationCase(const SyntheticWindowOptions& options)
      : synthetic(testing::makeSyntheticWindow(options)),
        window(buildVisualWindow(synthetic.calibration, synthetic.keyframes(), 0.5)),
        points(stereoPoints(window, kLargestChi2)) {
    const SE3 T_VW = synthetic.truth[0].T_WB.inverse();
    for (const StampedState& s : synthetic.truth) T_VB.push_back(T_VW * s.T_WB);
    for (const LandmarkId id : window.landmark_ids)
      landmarks.push_back(T_VW * synthetic.landmarks[id]);
  }
  testing::SyntheticWindow synthetic;
  VisualWindow window;
  StereoPoints points;
  std::vector<SE3> T_VB;            ///< the truth
  std::vector<Vector3d> landmarks;  ///< the truth, p_V
};

SyntheticWindowOptions small(double outlier_share = 0.0) {
  SyntheticWindowOptions options;
  options.motion = Motion::kAggressive;
  options.keyframes = 4;
  options.landmarks = 30;
  options.outlier_share = outlier_share;
  return options;
}

std::vector<SE3> disturbed(const std::vector<SE3>& T_VB) {
  std::vector<SE3> result = T_VB;
  for (size_t k = 1; k < result.size(); ++k) {
    result[k].R = result[k].R * expSO3(0.01 * Vector3d(1, -2, 1));
    result[k].t += 0.03 * static_cast<double>(k) * Vector3d(1, 1, -2);
  }
  return result;
}

double farthest(const std::vector<SE3>& a, const std::vector<SE3>& b) {
  double result = 0.0;
  for (size_t k = 0; k < a.size(); ++k)
    result = std::max(result, (a[k].matrix() - b[k].matrix()).norm());
  return result;
}

/** Reprojection residuals of all measurements of valid landmarks. */
VectorXd residuals(const InformationCase& c, const TrackInformation& tracks,
                   const std::vector<SE3>& T, const std::vector<Vector3d>& l) {
  std::vector<double> r;
  for (const VisualMeasurement& m : c.window.measurements) {
    const size_t i = m.landmark, k = m.keyframe;
    if (!tracks.valid()[i]) continue;
    const Vector3d p_C = c.window.T_CB[m.camera] * (T[k].inverse() * l[i]);
    const Vector2d e = m.measurement.sqrt_information * (p_C.hnormalized() - m.measurement.xy);
    r.push_back(e.x());
    r.push_back(e.y());
  }
  return Eigen::Map<VectorXd>(r.data(), r.size());
}

TEST(TrackInformation, IsTheSchurComplementOfTheRowsByNumericalDerivatives) {
  const InformationCase c(small());
  const std::vector<SE3> T = disturbed(c.T_VB);
  TrackInformation tracks(c.window, kNotRobust);
  tracks.start(c.points, T);
  tracks.triangulate(T);
  tracks.linearize(T);
  const std::vector<Vector3d> l = tracks.landmarks();
  ASSERT_GT(tracks.validCount(), 10);

  const Index poses = 6 * (T.size() - 1);
  const VectorXd r = residuals(c, tracks, T, l);
  MatrixXd J(r.size(), poses);
  constexpr double kStep = 1e-5;
  for (size_t k = 1; k < T.size(); ++k)
    J.middleCols<6>(6 * (k - 1)) = testing::numericalJacobian(
        [&](const SE3& pose) {
          std::vector<SE3> moved = T;
          moved[k] = pose;
          return residuals(c, tracks, moved, l);
        },
        T[k], kStep);
  MatrixXd A(r.size(), 3 * tracks.validCount());
  Index column = 0;
  for (size_t landmark = 0; landmark < l.size(); ++landmark) {
    if (!tracks.valid()[landmark]) continue;
    A.middleCols<3>(column) = testing::numericalJacobian(
        [&](const Vector3d& position) {
          std::vector<Vector3d> moved = l;
          moved[landmark] = position;
          return residuals(c, tracks, T, moved);
        },
        l[landmark], kStep);
    column += 3;
  }
  const Eigen::LDLT<MatrixXd> landmarks(A.transpose() * A);
  const MatrixXd S = J.transpose() * J - J.transpose() * A * landmarks.solve(A.transpose() * J);
  const VectorXd s = -J.transpose() * r + J.transpose() * A * landmarks.solve(A.transpose() * r);
  // Differences, and the landmarks' damping of 1e-9 of their weight, times the condition of far
  // ones.
  EXPECT_LT((tracks.S() - S).norm(), 1e-5 * S.norm());
  EXPECT_LT((tracks.s() - s).norm(), 1e-5 * s.norm());
}

/**
 * The gradient at the truth is noise alone, of mean zero. With the depth's derivative taken from
 * the measured direction the pixels' noise stands in derivative and residual, and the mean of the
 * landmark's distance from the camera is off by sigmas of a single window.
 */
TEST(TrackInformation, ItsGradientAtTheTruthHasTheMeanZero) {
  constexpr int kWindows = 60;
  constexpr double kSigmaPx = 1.0;
  VectorXd sum;
  MatrixXd information;
  for (unsigned seed = 1; seed <= kWindows; ++seed) {
    SyntheticWindowOptions options = small();
    options.motion = Motion::kStandstill;
    options.sigma_px = kSigmaPx;
    options.frames_per_keyframe = 1;
    options.seed = seed;
    InformationCase c(options);
    c.window = buildVisualWindow(c.synthetic.calibration, c.synthetic.keyframes(), kSigmaPx);
    StereoPoints truth = stereoPoints(c.window, 1e9);
    for (size_t l = 0; l < truth.of_landmark.size(); ++l)
      for (StereoPoints::Point& point : truth.of_landmark[l])
        point.p_B = c.T_VB[point.keyframe].inverse() * c.landmarks[l];
    TrackInformation tracks(c.window, kNotRobust);
    tracks.start(truth, c.T_VB);
    tracks.linearize(c.T_VB);
    if (seed == 1) {
      sum = VectorXd::Zero(tracks.s().size());
      information = MatrixXd::Zero(sum.size(), sum.size());
    }
    sum += tracks.s();
    information += tracks.S();
  }
  // Its covariance is the information: chi-square, with the 99.9 % quantile of 18 degrees.
  EXPECT_LT(squaredMahalanobis(sum, information), 42.3);
}

TEST(TrackInformation, ItsStepsLeadToTheTruthWithoutNoise) {
  for (const double scale : {std::sqrt(kChi2Pixel), kNotRobust}) {
    const InformationCase c(small());
    std::vector<SE3> T = disturbed(c.T_VB);
    TrackInformation tracks(c.window, scale);
    tracks.start(c.points, T);
    for (int pass = 0; pass < 20; ++pass) {
      tracks.triangulate(T);
      tracks.linearize(T);
      const VectorXd y = tracks.S().ldlt().solve(tracks.s());
      for (size_t k = 1; k < T.size(); ++k) {
        const Index i = 6 * (k - 1);
        T[k].R = T[k].R * expSO3(y.segment<3>(i));
        T[k].t += y.segment<3>(i + 3);
      }
    }
    tracks.triangulate(T);
    EXPECT_LT(farthest(T, c.T_VB), 1e-6);
    EXPECT_TRUE(tracks.nearFinalScale());
    EXPECT_EQ(tracks.inlierShare(kLargestChi2), 1.0);
    for (size_t l = 0; l < c.landmarks.size(); ++l)
      if (tracks.valid()[l]) {
        EXPECT_LT((tracks.landmarks()[l] - c.landmarks[l]).norm(), 1e-5);
      }
  }
}

TEST(TrackInformation, KeepsItsLandmarksBeforeTheCameras) {
  for (unsigned seed = 1; seed <= 10; ++seed) {
    SyntheticWindowOptions options = small();
    options.sigma_px = 1.0;
    options.landmarks = 100;
    options.seed = seed;
    const InformationCase c(options);
    TrackInformation tracks(c.window, std::sqrt(kChi2Pixel));
    tracks.start(c.points, c.T_VB);
    // Poses that the landmarks do not fit: steps are large.
    std::vector<SE3> T = c.T_VB;
    for (size_t k = 1; k < T.size(); ++k) T[k].R = T[k].R * expSO3(0.2 * Vector3d(1, -1, 1));
    for (int pass = 0; pass < 10; ++pass) tracks.triangulate(pass % 2 == 0 ? T : c.T_VB);
    for (const VisualMeasurement& m : c.window.measurements) {
      if (m.keyframe != 0 || !tracks.valid()[m.landmark]) continue;
      const Vector3d p_C = c.window.T_CB[m.camera] * tracks.landmarks()[m.landmark];
      EXPECT_GT(p_C.z(), 0.1) << "seed " << seed;
    }
  }
}

TEST(TrackInformation, SaysLessFarFromTheSolution) {
  const InformationCase c(small());
  const auto information = [&](const std::vector<SE3>& T) {
    TrackInformation tracks(c.window, std::sqrt(kChi2Pixel));
    tracks.start(c.points, T);
    for (int i = 0; i < 5; ++i) tracks.triangulate(T);
    tracks.linearize(T);
    return std::make_pair(tracks.S().norm(), tracks.nearFinalScale());
  };
  const auto [near, near_final] = information(c.T_VB);
  const auto [far, far_final] = information(disturbed(c.T_VB));
  EXPECT_TRUE(near_final);
  EXPECT_FALSE(far_final);
  EXPECT_LT(far, 0.1 * near);
}

/** 120 landmarks tell the pixels' variance to 4 %; a fifth is five standard deviations. */
TEST(TrackInformation, SaysWhatItsResidualsShowWhereTheirNoiseIsLessThanBelieved) {
  SyntheticWindowOptions options = small();
  options.landmarks = 120;
  options.sigma_px = 0.1;
  InformationCase c(options);
  const auto size = [&c](double believed_px, double least_noise) {
    c.window = buildVisualWindow(c.synthetic.calibration, c.synthetic.keyframes(), believed_px);
    TrackInformation tracks(c.window, std::sqrt(kChi2Pixel), least_noise);
    tracks.start(c.points, c.T_VB);
    for (int i = 0; i < 8; ++i) tracks.triangulate(c.T_VB);
    tracks.linearize(c.T_VB);
    return tracks.S().norm();
  };
  const double right = size(0.1, 1.0);
  EXPECT_NEAR(size(0.5, 0.1) / right, 1.0, 0.2);
  EXPECT_LT(size(0.5, 1.0), 0.1 * right);
  EXPECT_GT(size(0.5, 0.5), 3.0 * size(0.5, 1.0));  // no less than half of what is believed
  EXPECT_LT(size(0.5, 0.5), 5.0 * size(0.5, 1.0));
}

TEST(TrackInformation, CountsOutliersAndLeavesOutLandmarksWithoutStereoPoint) {
  SyntheticWindowOptions options = small(0.1);
  options.landmarks = 150;
  const InformationCase c(options);
  TrackInformation tracks(c.window, std::sqrt(kChi2Pixel));
  tracks.start(c.points, c.T_VB);
  for (int i = 0; i < 5; ++i) tracks.triangulate(c.T_VB);
  // Of landmarks that have a stereo point; fewer of their pixels are wrong than of all.
  EXPECT_NEAR(tracks.inlierShare(kLargestChi2), 0.92, 0.05);
  int with_point = 0;
  for (const auto& of_one : c.points.of_landmark) with_point += of_one.empty() ? 0 : 1;
  EXPECT_EQ(tracks.validCount(), with_point);
  EXPECT_LT(with_point, c.window.landmarkCount());

  StereoPoints none = c.points;
  for (auto& of_one : none.of_landmark) of_one.clear();
  tracks.start(none, c.T_VB);
  EXPECT_EQ(tracks.validCount(), 0);
  EXPECT_EQ(tracks.inlierShare(kLargestChi2), 0.0);
}

/** With near landmarks curvature and score are the Schur complement that the steps use; landmarks at
 * infinity turn noise into score, and the curvature by position is then noise around zero. */
TEST(TrackInformation, OfFarLandmarksIsInTheScoreButNotInTheCurvature) {
  const auto information = [](double distance_m, bool* same) {
    SyntheticWindowOptions options = small();
    options.landmarks = 120;
    options.sigma_px = 0.5;
    options.frames_per_keyframe = 1;
    options.landmark_distance_m = distance_m;
    const InformationCase c(options);
    TrackInformation tracks(c.window, kNotRobust);
    tracks.start(c.points, c.T_VB);
    for (int i = 0; i < 8; ++i) tracks.triangulate(c.T_VB);
    tracks.linearize(c.T_VB);
    const NormalEquations equations = tracks.information(c.T_VB);
    *same = (equations.score - tracks.S()).norm() < 1e-3 * tracks.S().norm();
    double score = 0.0, curvature = 0.0;
    for (Index k = 0; k + 1 < static_cast<Index>(c.T_VB.size()); ++k) {
      score += equations.score.diagonal().segment<3>(6 * k + 3).sum();
      curvature += equations.curvature.diagonal().segment<3>(6 * k + 3).sum();
    }
    return curvature / score;
  };
  bool same = false;
  EXPECT_NEAR(information(3.0, &same), 1.0, 0.01);
  EXPECT_TRUE(same);
  EXPECT_LT(information(1e6, &same), 0.3);
}

/** Residuals at a wrong depth look like a curvature. */
TEST(TrackInformation, LandmarksComeToRestBeforeTheirCurvatureIsAsked) {
  SyntheticWindowOptions options = small();
  options.landmarks = 120;
  options.sigma_px = 0.5;
  options.landmark_distance_m = 40.0;
  const InformationCase c(options);
  const auto curvature = [&c](int passes, int most_moves) {
    TrackInformation tracks(c.window, kNotRobust);
    tracks.start(c.points, c.T_VB);
    for (int i = 0; i < passes; ++i) tracks.triangulate(c.T_VB, most_moves);
    return tracks.information(c.T_VB).curvature;
  };
  const MatrixXd wanted = curvature(50, 1);
  EXPECT_LT((curvature(1, 20) - wanted).norm(), 0.1 * (curvature(1, 1) - wanted).norm());
}

}  // namespace
}  // namespace etalon
