#include "etalon/optimization/bundle/visual_window.h"

#include <Eigen/Cholesky>
#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <iterator>
#include <map>

#include "etalon/core/so3.h"
#include "etalon/optimization/residuals/huber.h"

namespace etalon {

VisualWindow buildVisualWindow(const StereoInertialCalibration& calibration,
                               const std::vector<const TrackedFrame*>& keyframes, double sigma_px,
                               const std::vector<MoreObservation>& more) {
  using Sighting = MoreObservation;
  std::map<LandmarkId, std::vector<Sighting>> sightings;
  size_t count = 2 * more.size();
  for (size_t k = 0; k < keyframes.size(); ++k) {
    auto next = sightings.begin();  // a frame's landmarks are in order
    for (const Observation& o : keyframes[k]->observations) {
      const auto at = sightings.try_emplace(next, o.id);
      at->second.push_back({static_cast<int>(k), &o, sigma_px});
      next = std::next(at);
      count += o.has_right ? 2 : 1;
    }
  }
  for (const MoreObservation& o : more) {
    std::vector<Sighting>& seen = sightings[o.observation->id];
    const auto after = std::find_if(seen.begin(), seen.end(),
                                    [&o](const Sighting& s) { return s.keyframe >= o.keyframe; });
    if (after == seen.end() || after->keyframe > o.keyframe) seen.insert(after, o);
  }

  VisualWindow window;
  window.keyframe_count = keyframes.size();
  window.measurements.reserve(count);
  for (size_t c = 0; c < 2; ++c) window.T_CB[c] = calibration.cameras[c].T_BC.inverse();
  for (const auto& [id, seen] : sightings) {
    bool has_stereo = false;
    for (const Sighting& s : seen) has_stereo |= s.observation->has_right;
    if (static_cast<int>(seen.size()) + (has_stereo ? 1 : 0) < 2) continue;
    const int landmark = window.landmarkCount();
    const int first = window.measurements.size();
    for (const Sighting& s : seen) {
      for (int camera = 0; camera < (s.observation->has_right ? 2 : 1); ++camera) {
        const auto m =
            makeMeasurement(calibration.cameras[camera].model,
                            camera == 0 ? s.observation->left : s.observation->right, s.sigma_px);
        if (m) window.measurements.push_back({s.keyframe, landmark, camera, *m, false});
      }
    }
    if (window.measurements.size() < static_cast<size_t>(first) + 2) {
      window.measurements.resize(first);
      continue;
    }
    window.first.push_back(first);
    window.landmark_ids.push_back(id);
  }
  window.first.push_back(window.measurements.size());
  return window;
}

namespace {

/** A landmark on the ray of its first measurement, its inverse depth from the others by linear
 * least squares in the sines of the angles between rays. */
InverseDepthLandmark firstGuess(const VisualWindow& window, int begin, int end,
                                const std::vector<SE3>& T_WB) {
  Eigen::Vector3d origin = Eigen::Vector3d::Zero(), first_ray = Eigen::Vector3d::UnitZ();
  double numerator = 0.0, denominator = 0.0;
  for (int i = begin; i < end; ++i) {
    const VisualMeasurement& m = window.measurements[i];
    const SE3 T_WC = T_WB[m.keyframe] * window.T_CB[m.camera].inverse();
    const Eigen::Vector3d ray = T_WC.R * m.measurement.ray().normalized();
    if (i == begin) {
      origin = T_WC.t;
      first_ray = ray;
      continue;
    }
    const Eigen::Vector3d n = ray.cross(origin - T_WC.t);
    numerator -= n.dot(ray.cross(first_ray));
    denominator += n.squaredNorm();
  }
  InverseDepthLandmark landmark(origin + first_ray, origin);
  landmark.parameters.z() = denominator > 0.0 ? std::max(0.0, numerator / denominator) : 0.0;
  return landmark;
}

/** Gauss-Newton on the whitened reprojection residuals of one landmark, rho >= 0. */
bool refineLandmark(const VisualWindow& window, int begin, int end, const std::vector<SE3>& T_WB,
                    InverseDepthLandmark* landmark) {
  for (int iteration = 0; iteration < 5; ++iteration) {
    Eigen::Matrix3d H = Eigen::Matrix3d::Zero();
    Eigen::Vector3d b = Eigen::Vector3d::Zero();
    for (int i = begin; i < end; ++i) {
      const VisualMeasurement& m = window.measurements[i];
      Eigen::Vector2d r;
      Eigen::Matrix<double, 2, 3> J;
      if (!window.residual(m, T_WB, *landmark, &r, nullptr, &J)) return false;
      const double weight = huberWeight(r.norm(), 3.0);
      H.noalias() += weight * J.transpose() * J;
      b.noalias() += weight * J.transpose() * r;
    }
    const double sigma2 = H.inverse()(2, 2);  // of rho
    if (!(sigma2 >= 0.0 && sigma2 <= kMaxSigmaInverseDepth * kMaxSigmaInverseDepth)) return false;
    Eigen::Vector3d step = H.ldlt().solve(-b);
    if (landmark->parameters.z() + step.z() < 0.0) {  // to the edge, and the bearing alone
      step.z() = -landmark->parameters.z();
      const Eigen::Vector2d rest = b.head<2>() + H.topRightCorner<2, 1>() * step.z();
      step.head<2>() = H.topLeftCorner<2, 2>().ldlt().solve(-rest);
    }
    if (!step.allFinite()) return false;
    landmark->parameters += step;
    if (step.squaredNorm() < 1e-16) break;
  }
  return true;
}

}  // namespace

std::optional<Eigen::Vector3d> triangulate(const VisualWindow& window, int l,
                                           const std::vector<SE3>& T_WB) {
  const int begin = window.first[l];
  const int end = window.first[l + 1];
  InverseDepthLandmark landmark = firstGuess(window, begin, end, T_WB);
  if (!refineLandmark(window, begin, end, T_WB, &landmark)) return std::nullopt;
  const Eigen::Vector3d p_W = landmark.position();
  Eigen::Vector2d r;
  for (int i = begin; i < end; ++i) {
    const VisualMeasurement& m = window.measurements[i];
    if (!window.residual(m, T_WB, p_W, &r)) return std::nullopt;
  }
  return p_W;
}

}  // namespace etalon
