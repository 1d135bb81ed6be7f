#include "rig_check.h"

#include <Eigen/Dense>
#include <cmath>
#include <functional>
#include <map>

#include "etalon/core/errors.h"
#include "etalon/core/so3.h"
#include "etalon/optimization/bundle/stereo_ba.h"

namespace etalon {

namespace {

constexpr double kSigmaPx = 0.3;      // of a track on real images
constexpr double kPerThousand = 1e3;  // all parameters are told in thousandths
constexpr double kStep = 0.5;         // of the differences: moves pixels by about a quarter

/** A parameter and how it changes a calibration; the amount is in thousandths. */
struct Knob {
  std::string name, unit;
  std::function<void(StereoInertialCalibration*, double)> turn;
};

void rotateRight(StereoInertialCalibration* rig, int axis, double mrad) {
  Eigen::Matrix3d& R_BC1 = rig->cameras[1].T_BC.R;
  R_BC1 = R_BC1 * expSO3(-mrad / kPerThousand * Eigen::Vector3d::Unit(axis));
}

/** Moves the right camera across the baseline, whose length is kept. */
void moveRight(StereoInertialCalibration* rig, int axis, double mm) {
  const SE3 T_BC0 = rig->cameras[0].T_BC;
  SE3& T_BC1 = rig->cameras[1].T_BC;
  const Eigen::Vector3d moved = T_BC1.t - T_BC0.t + mm / kPerThousand * T_BC1.R.col(axis);
  T_BC1.t = T_BC0.t + rig->baseline() * moved.normalized();
}

std::vector<Knob> knobs() {
  using Rig = StereoInertialCalibration;
  std::vector<Knob> all;
  for (int axis = 0; axis < 3; ++axis)
    all.push_back({std::string("right camera turned about ") + "xyz"[axis], "mrad",
                   [axis](Rig* rig, double amount) { rotateRight(rig, axis, amount); }});
  for (int axis = 1; axis < 3; ++axis)
    all.push_back({std::string("right camera moved along ") + "xyz"[axis], "mm",
                   [axis](Rig* rig, double amount) { moveRight(rig, axis, amount); }});
  const auto both = [&all](const std::string& name,
                           const std::function<void(CameraModel*, double)>& turn) {
    all.push_back({name + ", both cameras", "1e-3", [turn](Rig* rig, double amount) {
                     for (CameraCalibration& camera : rig->cameras) turn(&camera.model, amount);
                   }});
    all.push_back({name + ", right camera less left", "1e-3", [turn](Rig* rig, double amount) {
                     turn(&rig->cameras[0].model, -amount / 2);
                     turn(&rig->cameras[1].model, amount / 2);
                   }});
  };
  both("focal length", [](CameraModel* camera, double amount) {
    for (const char* name : {"fu", "fv"})
      *camera = camera->with(name, camera->parameter(name) * (1.0 + amount / kPerThousand));
  });
  both("radial distortion k1", [](CameraModel* camera, double amount) {
    *camera = camera->with("k1", camera->parameter("k1") + amount / kPerThousand);
  });
  // A difference between the cameras looks like a turn of the right camera.
  for (const bool vertical : {false, true})
    all.push_back({std::string("principal point, both cameras, ") + (vertical ? "v" : "u"),
                   "1e-3 of f", [vertical](Rig* rig, double amount) {
                     const char* name = vertical ? "cv" : "cu";
                     for (CameraCalibration& camera : rig->cameras)
                       camera.model = camera.model.with(
                           name, camera.model.parameter(name) +
                                     amount / kPerThousand * camera.model.focal().x());
                   }});
  return all;
}

/** Poses and landmarks that fit the tracks best, and the residuals. */
struct Fit {
  std::vector<SE3> T_VB;
  std::map<LandmarkId, Eigen::Vector3d> landmarks;
  Eigen::VectorXd residuals;  ///< whitened, two a measurement
  std::vector<int> landmark;  ///< that a measurement belongs to
};

StereoBaResult adjust(const VisualWindow& window, const std::vector<SE3>& T_VB,
                      const std::map<LandmarkId, Eigen::Vector3d>& known,
                      const StereoBaOptions& options) {
  BundleProblem bundle(window, known);
  if (known.empty()) bundle.triangulateMissing(T_VB);
  return solveStereoBa(std::move(bundle), T_VB, options);
}

/** Least squares over all of `frames`, which have no outliers. */
Fit fit(const StereoInertialCalibration& calibration, const std::vector<TrackedFrame>& frames,
        const Fit& start) {
  std::vector<const TrackedFrame*> keyframes;
  for (const TrackedFrame& frame : frames) keyframes.push_back(&frame);
  const VisualWindow window = buildVisualWindow(calibration, keyframes, kSigmaPx);
  StereoBaOptions options;
  options.rounds = 3;
  options.iterations_per_round = 20;
  options.chi2_threshold = 1e9;
  const StereoBaResult result = adjust(window, start.T_VB, start.landmarks, options);
  Fit better;
  better.T_VB = result.T_VB;
  better.landmarks = result.bundle.validLandmarks();
  better.residuals.setZero(2 * window.measurements.size());
  for (size_t i = 0; i < window.measurements.size(); ++i) {
    const VisualMeasurement& m = window.measurements[i];
    better.landmark.push_back(m.landmark);
    Eigen::Vector2d r = Eigen::Vector2d::Zero();
    const BundleLandmark& landmark = result.bundle.landmarks[m.landmark];
    if (landmark.valid && window.residual(m, result.T_VB, landmark.position, &r))
      better.residuals.segment<2>(2 * i) = r;
  }
  return better;
}

/** The observations of `keyframes` that are inliers of `window`. */
std::vector<TrackedFrame> inliersOf(const std::vector<const TrackedFrame*>& keyframes,
                                    const VisualWindow& window) {
  std::vector<TrackedFrame> frames(keyframes.size());
  for (size_t k = 0; k < keyframes.size(); ++k) frames[k].t = keyframes[k]->t;
  std::vector<std::map<LandmarkId, std::array<bool, 2>>> good(keyframes.size());
  for (const VisualMeasurement& m : window.measurements)
    if (m.inlier) good[m.keyframe][window.landmark_ids[m.landmark]][m.camera] = true;
  for (size_t k = 0; k < keyframes.size(); ++k)
    for (Observation o : keyframes[k]->observations) {
      const auto seen = good[k].find(o.id);
      if (seen == good[k].end() || !seen->second[0]) continue;
      o.has_right = o.has_right && seen->second[1];
      frames[k].observations.push_back(o);
    }
  return frames;
}

double rmsPx(const Fit& fit) {
  return kSigmaPx *
         std::sqrt(fit.residuals.squaredNorm() / static_cast<double>(fit.residuals.size()));
}

/** x that minimises |r + J x|, and its standard errors from the scatter of the landmarks' parts of
 * J^T (r + J x). */
void step(const Eigen::MatrixXd& J, const Fit& base, std::vector<RigParameter>* parameters) {
  const Eigen::Index n = J.cols();
  const Eigen::MatrixXd inverse = (J.transpose() * J).ldlt().solve(Eigen::MatrixXd::Identity(n, n));
  const Eigen::VectorXd x = -inverse * (J.transpose() * base.residuals);
  const Eigen::VectorXd left = base.residuals + J * x;
  std::map<int, Eigen::VectorXd> by_landmark;
  for (size_t i = 0; i < base.landmark.size(); ++i) {
    const Eigen::Index row = 2 * i;
    Eigen::VectorXd& sum =
        by_landmark.emplace(base.landmark[i], Eigen::VectorXd::Zero(n)).first->second;
    sum += J.middleRows<2>(row).transpose() * left.segment<2>(row);
  }
  Eigen::MatrixXd scatter = Eigen::MatrixXd::Zero(n, n);
  for (const auto& [landmark, part] : by_landmark) scatter += part * part.transpose();
  const Eigen::VectorXd variance = (inverse * scatter * inverse).diagonal();
  for (Eigen::Index p = 0; p < n; ++p) {
    (*parameters)[p].correction = x[p];
    (*parameters)[p].sigma = std::sqrt(variance[p]);
  }
}

}  // namespace

RigCheck checkRig(const StereoInertialCalibration& calibration,
                  const std::vector<const TrackedFrame*>& keyframes, const std::vector<SE3>& T_VB) {
  const VisualWindow window = buildVisualWindow(calibration, keyframes, kSigmaPx);
  const StereoBaResult robust = adjust(window, T_VB, {}, {});
  const std::vector<TrackedFrame> frames = inliersOf(keyframes, robust.bundle.window);
  const Fit base = fit(calibration, frames, {robust.T_VB, robust.bundle.validLandmarks(), {}, {}});
  const std::vector<Knob> all = knobs();
  RigCheck check;
  Eigen::MatrixXd J(base.residuals.size(), all.size());
  for (size_t p = 0; p < all.size(); ++p) {
    RigParameter parameter;
    parameter.name = all[p].name;
    parameter.unit = all[p].unit;
    std::array<Eigen::VectorXd, 2> residuals;
    for (size_t side = 0; side < 2; ++side) {
      StereoInertialCalibration changed = calibration;
      all[p].turn(&changed, side == 0 ? -kStep : kStep);
      Fit changed_fit = fit(changed, frames, base);
      if (changed_fit.residuals.size() != base.residuals.size())
        throw Error("a pixel cannot be undistorted any more: " + all[p].name);
      residuals[side] = std::move(changed_fit.residuals);
      parameter.T_VB_changed[side] = std::move(changed_fit.T_VB);
    }
    J.col(p) = (residuals[1] - residuals[0]) / (2.0 * kStep);
    check.parameters.push_back(std::move(parameter));
  }
  step(J, base, &check.parameters);
  check.corrected = calibration;
  for (size_t p = 0; p < all.size(); ++p)
    all[p].turn(&check.corrected, check.parameters[p].correction);
  const Fit after = fit(check.corrected, frames, base);
  check.T_VB = base.T_VB;
  check.T_VB_corrected = after.T_VB;
  check.rms_px = rmsPx(base);
  check.rms_px_corrected = rmsPx(after);
  return check;
}

}  // namespace etalon
