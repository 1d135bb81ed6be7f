// stereo_scale SRC [--truth TUM] [--from S] [--to S]
//
// Is stereo odometry's scale too small or too large, and why? SRC is a recording (EuRoC
// folder or .rawlog) with ground truth, or with TUM in its place; from S to S after the first
// image. Prints
//  - by window of ten keyframes at 4 Hz: the ground truth's extent (RMS distance from its middle);
//    its scale against the odometry's, fitted both ways (a Sim(3) fit is pulled to small by the
//    noise of the points that it scales, so that the two differ by what noise does); the standard
//    error of vision in it, from four disjoint parts of the landmarks; and the scale with the
//    calibration that fits the images best;
//  - over all keyframes the scale, its standard error from leaving out a second at a time, which
//    allows for correlated errors of neighbours; with the calibration as given, as it fits the
//    images best, and with a free lever arm between the ground truth's body and the rig's;
//  - the same from the IMU alone, against vision and against the truth: inertial-only MAP, whose
//    cost is a parabola of the scale (biases and direction of gravity free, accelerometer's noise
//    as a flying platform has it, its scale factor taken for exact);
//  - the corrections of the calibration that fit the images best (rig_check.h).
// A wrong baseline and a bias of the matching scale all windows alike.

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <opencv2/core/utility.hpp>
#include <string>

#include "cut_tracks.h"
#include "etalon/benchmark/sequence_tracks.h"
#include "etalon/core/errors.h"
#include "etalon/core/so3.h"
#include "etalon/core/trajectory.h"
#include "etalon/datasets/recorded_source.h"
#include "etalon/evaluation/alignment.h"
#include "etalon/frontend/keyframe_selector.h"
#include "etalon/imu/preintegration.h"
#include "etalon/initialization/steps/inertial_only_map.h"
#include "etalon/odometry/visual_solution.h"
#include "etalon/testing/program.h"
#include "rig_check.h"

namespace {

using namespace etalon;
using Points = std::vector<Eigen::Vector3d>;

constexpr size_t kWindow = 10;       // keyframes
constexpr int64_t kEveryFrames = 7;  // from a window's start to the next one's
constexpr double kBlockSeconds = 1.0;
constexpr double kGyroNoiseFactor = 1.5, kAccelNoiseFactor = 6.0;  // docs/noise.md

/** Keyframes with their true positions. */
struct Keyframes {
  std::vector<const TrackedFrame*> frames;
  std::vector<Eigen::Matrix3d> R_prev_cur;
  std::vector<Preintegration> imu;  ///< between neighbours
  Points truth;
  std::vector<SE3> T_WB;  ///< true
};

/** @throws DataError where stereo odometry loses its way */
VisualSolution solved(const StereoInertialCalibration& calibration, const Keyframes& keyframes,
                      const StereoOdometryOptions& options) {
  auto solution = solveStereoOdometry(calibration, keyframes.frames, keyframes.R_prev_cur, options);
  if (!solution) throw DataError("", 0, solution.error().reason);
  return std::move(*solution);
}

Keyframes keyframesFrom(const SequenceTracks& tracks, size_t first, size_t most) {
  Keyframes keyframes;
  ImuNoiseDensities noise = tracks.calibration.imu.noise;
  noise.gyro_noise_density *= kGyroNoiseFactor;
  noise.accel_noise_density *= kAccelNoiseFactor;
  KeyframeSelector selector(KeyframeSelectorOptions{});
  for (size_t i = first; i < tracks.frames.size() && keyframes.frames.size() < most; ++i) {
    const TrackedFrame& frame = tracks.frames[i];
    const auto truth = tracks.ground_truth.at(frame.t);
    if (!truth || !selector.isKeyframe(frame.t)) continue;
    if (!keyframes.frames.empty()) {
      keyframes.imu.emplace_back(tracks.imu.between(keyframes.frames.back()->t, frame.t), ImuBias(),
                                 noise);
      keyframes.R_prev_cur.push_back(keyframes.imu.back().deltas().dR);
    }
    keyframes.frames.push_back(&frame);
    keyframes.truth.push_back(truth->T_WB.t);
    keyframes.T_WB.push_back(truth->T_WB);
  }
  return keyframes;
}

Points positions(const std::vector<SE3>& poses) {
  Points points;
  for (const SE3& pose : poses) points.push_back(pose.t);
  return points;
}

double extent(const Points& points) {
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  for (const Eigen::Vector3d& p : points) mean += p / static_cast<double>(points.size());
  double sum = 0.0;
  for (const Eigen::Vector3d& p : points) sum += (p - mean).squaredNorm();
  return std::sqrt(sum / static_cast<double>(points.size()));
}

/** The truth's scale against the estimate's: mean of the two ways of fitting it. */
double scaleOf(const Points& truth, const Points& estimate) {
  return std::sqrt(alignPoints(truth, estimate, AlignmentType::kSim3).scale /
                   alignPoints(estimate, truth, AlignmentType::kSim3).scale);
}

double rmsMillimetres(const Points& a, const Points& b, AlignmentType type) {
  const Alignment alignment = alignPoints(a, b, type);
  double sum = 0.0;
  for (size_t i = 0; i < a.size(); ++i) sum += (a[i] - alignment * b[i]).squaredNorm();
  return 1e3 * std::sqrt(sum / static_cast<double>(a.size()));
}

/** The truth as scale * R * (p + R_VB lever) + t of the estimate's poses. */
struct LeverFit {
  double scale = 1.0;
  Eigen::Vector3d lever = Eigen::Vector3d::Zero();  ///< m, in B
  double rms_mm = 0.0;
};

LeverFit fitLever(const Points& truth, const std::vector<SE3>& T_VB) {
  const Alignment start = alignPoints(truth, positions(T_VB), AlignmentType::kSim3);
  Eigen::Matrix3d R = start.T_GW.R;
  Eigen::Vector3d t = start.T_GW.t;
  LeverFit fit{start.scale, Eigen::Vector3d::Zero(), 0.0};
  for (int iteration = 0; iteration < 4; ++iteration) {
    Eigen::Matrix<double, 10, 10> H = Eigen::Matrix<double, 10, 10>::Zero();
    Eigen::Matrix<double, 10, 1> b = Eigen::Matrix<double, 10, 1>::Zero();
    double sum = 0.0;
    for (size_t k = 0; k < truth.size(); ++k) {
      const Eigen::Vector3d q = R * (T_VB[k].t + T_VB[k].R * fit.lever);
      const Eigen::Vector3d e = truth[k] - (fit.scale * q + t);
      Eigen::Matrix<double, 3, 10> J;  // scale, rotation (in the world), translation, lever
      J << q, -fit.scale * hat(q), Eigen::Matrix3d::Identity(), fit.scale * R * T_VB[k].R;
      H += J.transpose() * J;
      b += J.transpose() * e;
      sum += e.squaredNorm();
    }
    fit.rms_mm = 1e3 * std::sqrt(sum / static_cast<double>(truth.size()));
    const Eigen::Matrix<double, 10, 1> x = H.ldlt().solve(b);
    fit.scale += x[0];
    R = expSO3(x.segment<3>(1)) * R;
    t += x.segment<3>(4);
    fit.lever += x.tail<3>();
  }
  return fit;
}

/** Standard error of a scale fitted to the keyframes, by the delete-a-block jackknife (Efron and
 * Tibshirani, An Introduction to the Bootstrap, 1993, chapter 11), blocks of a second. */
template <typename Scale>
double jackknife(const Keyframes& keyframes, const std::vector<SE3>& T_VB, const Scale& scale_of) {
  const auto blockOf = [&](size_t k) {
    return static_cast<int>(secondsBetween(keyframes.frames[0]->t, keyframes.frames[k]->t) /
                            kBlockSeconds);
  };
  const int blocks = blockOf(T_VB.size() - 1) + 1;
  double sum = 0.0, squares = 0.0;
  for (int block = 0; block < blocks; ++block) {
    Points truth;
    std::vector<SE3> rest;
    for (size_t k = 0; k < T_VB.size(); ++k)
      if (blockOf(k) != block) {
        truth.push_back(keyframes.truth[k]);
        rest.push_back(T_VB[k]);
      }
    const double scale = scale_of(truth, rest);
    sum += scale;
    squares += scale * scale;
  }
  return std::sqrt(std::max(0.0, (blocks - 1.0) / blocks * (squares - sum * sum / blocks)));
}

/** Standard error of vision's scale, from four disjoint parts of the landmarks. NaN if a part is
 * too small to be located. */
double visionsError(const SequenceTracks& tracks, const Keyframes& keyframes,
                    const StereoOdometryOptions& options) {
  constexpr int kParts = 4;
  double sum = 0.0, squares = 0.0;
  for (int part = 0; part < kParts; ++part) {
    std::vector<TrackedFrame> frames(keyframes.frames.size());
    std::vector<const TrackedFrame*> pointers;
    for (size_t k = 0; k < frames.size(); ++k) {
      frames[k].t = keyframes.frames[k]->t;
      for (const Observation& o : keyframes.frames[k]->observations)
        if (o.id % kParts == part) frames[k].observations.push_back(o);
      pointers.push_back(&frames[k]);
    }
    const auto solution =
        solveStereoOdometry(tracks.calibration, pointers, keyframes.R_prev_cur, options);
    if (!solution) return std::nan("");
    const double scale = scaleOf(keyframes.truth, positions(solution->T_VB));
    sum += scale;
    squares += scale * scale;
  }
  const double variance = std::max(0.0, squares - sum * sum / kParts) / (kParts - 1);
  return std::sqrt(variance / kParts);
}

/** Prints the scale of the IMU's motion against that of the poses. */
void printInertialScale(const char* name, const std::vector<SE3>& T_VB,
                        const std::vector<Preintegration>& imu) {
  InertialOnlyOptions options;
  options.prior_accel_information = 10.0;  // sigma 0.3 m/s^2: leaves the bias free
  const auto cost = [&](double scale) {
    std::vector<SE3> scaled = T_VB;
    for (SE3& pose : scaled) pose.t *= scale;
    return solveInertialOnlyMap(scaled, imu, options).summary.final_cost;
  };
  constexpr double kStep = 0.02;
  const double less = cost(1.0 - kStep), middle = cost(1.0), more = cost(1.0 + kStep);
  const double curvature = (less + more - 2.0 * middle) / (kStep * kStep);
  std::printf("scale of the IMU against %s: %.4f +- %.4f\n", name,
              1.0 - (more - less) / (2.0 * kStep) / curvature, 1.0 / std::sqrt(curvature));
}

/** Mean and scatter of the windows' scales. */
void printMean(const char* name, const std::vector<double>& scales) {
  double mean = 0.0, squares = 0.0;
  const auto count = static_cast<double>(scales.size());
  for (const double s : scales) mean += s / count;
  for (const double s : scales) squares += (s - mean) * (s - mean);
  std::printf("%zu overlapping windows, %s: mean %.4f, standard deviation %.4f\n", scales.size(),
              name, mean, scales.size() > 1 ? std::sqrt(squares / (count - 1.0)) : 0.0);
}

void printWindows(const SequenceTracks& tracks, const StereoInertialCalibration& corrected,
                  const StereoOdometryOptions& options) {
  std::printf(
      "window from, s | extent, m | scale, fitted both ways | vision's error | as the images want "
      "the rig\n");
  std::vector<double> given, better;
  for (size_t first = 0; first < tracks.frames.size(); first += kEveryFrames) {
    const Keyframes keyframes = keyframesFrom(tracks, first, kWindow);
    if (keyframes.frames.size() < kWindow) break;
    const auto estimate = [&](const StereoInertialCalibration& calibration) {
      return positions(solved(calibration, keyframes, options).T_VB);
    };
    const Points as_given = estimate(tracks.calibration);
    given.push_back(scaleOf(keyframes.truth, as_given));
    better.push_back(scaleOf(keyframes.truth, estimate(corrected)));
    std::printf("%14.2f | %9.3f |         %.4f, %.4f |         %.4f | %.4f\n",
                secondsBetween(tracks.frames[0].t, keyframes.frames[0]->t), extent(keyframes.truth),
                alignPoints(keyframes.truth, as_given, AlignmentType::kSim3).scale,
                1.0 / alignPoints(as_given, keyframes.truth, AlignmentType::kSim3).scale,
                visionsError(tracks, keyframes, options), better.back());
  }
  printMean("calibration as given", given);
  printMean("as the images want it", better);
}

void printScale(const char* name, const Keyframes& keyframes, const std::vector<SE3>& T_VB) {
  const Points estimate = positions(T_VB);
  const double error =
      jackknife(keyframes, T_VB, [](const Points& truth, const std::vector<SE3>& poses) {
        return scaleOf(truth, positions(poses));
      });
  std::printf("%s: scale %.4f +- %.4f; off by %.2f mm rms aligned in SE(3), %.2f in Sim(3)\n", name,
              scaleOf(keyframes.truth, estimate), error,
              rmsMillimetres(keyframes.truth, estimate, AlignmentType::kSE3),
              rmsMillimetres(keyframes.truth, estimate, AlignmentType::kSim3));
  const LeverFit fit = fitLever(keyframes.truth, T_VB);
  const double lever_error =
      jackknife(keyframes, T_VB, [](const Points& truth, const std::vector<SE3>& poses) {
        return fitLever(truth, poses).scale;
      });
  std::printf(
      "  with a free lever arm: scale %.4f +- %.4f, lever %.1f %.1f %.1f mm; off by %.2f mm "
      "rms\n",
      fit.scale, lever_error, 1e3 * fit.lever.x(), 1e3 * fit.lever.y(), 1e3 * fit.lever.z(),
      fit.rms_mm);
}

struct Arguments {
  std::string source, truth;
  double from_s = 0.0, to_s = 1e9;
};

SequenceTracks readTracks(const Arguments& arguments) {
  const auto recording = openRecording(arguments.source);
  SequenceTracks tracks = trackSequence(*recording, {});
  cutTracks(arguments.from_s, arguments.to_s, &tracks);
  if (!arguments.truth.empty()) {
    tracks.ground_truth = GroundTruth();
    for (const StampedPose& pose : readTum(arguments.truth)) {
      tracks.ground_truth.states.push_back({});
      tracks.ground_truth.states.back().t = pose.t;
      tracks.ground_truth.states.back().T_WB = pose.T_WB;
    }
  }
  return tracks;
}

void run(const Arguments& arguments) {
  const SequenceTracks tracks = readTracks(arguments);
  const StereoOdometryOptions options;
  const Keyframes keyframes = keyframesFrom(tracks, 0, tracks.frames.size());
  const VisualSolution start = solved(tracks.calibration, keyframes, options);
  const RigCheck check = checkRig(tracks.calibration, keyframes.frames, start.T_VB);
  printWindows(tracks, check.corrected, options);
  std::printf("all %zu keyframes, extent %.3f m\n", keyframes.frames.size(),
              extent(keyframes.truth));
  printScale("calibration as given", keyframes, check.T_VB);
  printScale("as the images want it", keyframes, check.T_VB_corrected);
  printInertialScale("vision, calibration as given", check.T_VB, keyframes.imu);
  printInertialScale("the ground truth", keyframes.T_WB, keyframes.imu);
  std::printf(
      "corrections that the images want (residuals %.4f px rms, then %.4f; keyframes move by %.2f "
      "mm "
      "rms):\n",
      check.rms_px, check.rms_px_corrected,
      rmsMillimetres(positions(check.T_VB_corrected), positions(check.T_VB), AlignmentType::kSE3));
  for (const RigParameter& p : check.parameters)
    std::printf("  %-46s %6.3f +- %.3f %s; one more would change the scale by %.4f\n",
                p.name.c_str(), p.correction, p.sigma, p.unit.c_str(),
                scaleOf(keyframes.truth, positions(p.T_VB_changed[1])) -
                    scaleOf(keyframes.truth, positions(p.T_VB_changed[0])));
}

}  // namespace

int main(int argc, char** argv) {
  cv::setNumThreads(1);
  Arguments arguments;
  CLI::App app("What a recording's images and IMU say of its scale", "stereo_scale");
  app.add_option("SRC", arguments.source, "EuRoC folder or .rawlog")->required();
  app.add_option("--truth", arguments.truth, "Ground truth to use instead of the recording's");
  app.add_option("--from", arguments.from_s, "Start, seconds after the first image");
  app.add_option("--to", arguments.to_s, "End, seconds after the first image");
  return testing::runProgram(&app, argc, argv, [&] { run(arguments); });
}
