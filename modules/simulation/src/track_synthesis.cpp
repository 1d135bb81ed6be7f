#include "etalon/simulation/track_synthesis.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

#include "random.h"

namespace etalon {

using Eigen::Vector2d;
using Eigen::Vector3d;

std::vector<Vector3d> scatterLandmarks(const std::vector<Vector3d>& positions, int count,
                                       std::uint64_t seed, double margin_m) {
  Eigen::AlignedBox3d box;
  for (const Vector3d& p_W : positions) box.extend(p_W);
  const Vector3d low = box.min().array() - margin_m, high = box.max().array() + margin_m;
  const Vector3d size = high - low;
  const Vector3d area(size.y() * size.z(), size.x() * size.z(), size.x() * size.y());
  Random random(seed, kLandmarkStream);
  std::vector<Vector3d> landmarks;
  for (int i = 0; i < count; ++i) {
    // One of three pairs of opposite sides, by area; then a point of it.
    const double pick = random.uniform(0.0, area.sum());
    const int axis = pick < area[0] ? 0 : pick < area[0] + area[1] ? 1 : 2;
    const bool far_side = random.uniform() < 0.5;
    Vector3d p;
    for (int k = 0; k < 3; ++k) p[k] = random.uniform(low[k], high[k]);
    p[axis] = far_side ? high[axis] : low[axis];
    landmarks.push_back(p);
  }
  return landmarks;
}

std::vector<Vector3d> scatterLandmarks(const SimulatedTrajectory& trajectory, int count,
                                       std::uint64_t seed, double margin_m) {
  std::vector<Vector3d> positions;
  for (TimeNs t = trajectory.start(); t <= trajectory.end(); t += 50'000'000)
    positions.push_back(trajectory.at(t).T_WB.t);
  return scatterLandmarks(positions, count, seed, margin_m);
}

namespace {

struct View {
  SE3 T_CW;
  const CameraModel& model;

  std::optional<Vector2d> see(const Vector3d& p_W, const TrackSynthesisOptions& options) const {
    const Vector3d p_C = T_CW * p_W;
    const double range = model.rangeOf(p_C);
    if (range < options.min_depth_m || range > options.max_depth_m) return std::nullopt;
    std::optional<Vector2d> pixel = model.project(p_C);
    if (!pixel || !model.inImage(*pixel, options.border_px)) return std::nullopt;
    return pixel;
  }
};

Vector2d disturb(const Vector2d& pixel, bool outlier, double sigma_px, Random* random) {
  const double dx = random->normal(), dy = random->normal();
  const double angle = random->uniform(0.0, 6.28318530717958647692);
  const double distance = random->uniform(5.0, 50.0);
  Vector2d moved = pixel + sigma_px * Vector2d(dx, dy);
  if (outlier) moved += distance * Vector2d(std::cos(angle), std::sin(angle));
  return moved;
}

}  // namespace

std::vector<TrackedFrame> simulateTracks(const Trajectory& poses,
                                         const StereoInertialCalibration& calibration,
                                         const std::vector<Vector3d>& landmarks,
                                         const TrackSynthesisOptions& options) {
  Random random(options.seed, kTrackStream);
  const size_t max_tracks = std::max(0, options.max_tracks);
  std::vector<char> tracked(landmarks.size(), 0);
  std::vector<TrackedFrame> frames;
  for (const StampedPose& pose : poses) {
    TrackedFrame frame;
    frame.t = pose.t;
    const auto& cameras = calibration.cameras;
    const View left{(pose.T_WB * cameras[0].T_BC).inverse(), cameras[0].model};
    const View right{(pose.T_WB * cameras[1].T_BC).inverse(), cameras[1].model};

    std::vector<size_t> running, fresh;
    std::vector<Vector2d> pixels(landmarks.size());
    for (size_t id = 0; id < landmarks.size(); ++id) {
      const std::optional<Vector2d> pixel = left.see(landmarks[id], options);
      if (pixel) {
        pixels[id] = *pixel;
        (tracked[id] ? running : fresh).push_back(id);
      }
      tracked[id] = 0;
    }
    running.insert(running.end(), fresh.begin(), fresh.end());
    running.resize(std::min(running.size(), max_tracks));
    std::sort(running.begin(), running.end());
    for (size_t id : running) {
      tracked[id] = 1;
      const bool left_errs = random.uniform() < options.outlier_ratio;
      const bool keep_right = random.uniform() < options.right_ratio;
      const bool right_errs = random.uniform() < options.outlier_ratio;
      const std::optional<Vector2d> pixel = right.see(landmarks[id], options);
      Observation observation;
      observation.id = static_cast<LandmarkId>(id);
      observation.has_right = pixel && keep_right;
      observation.left = disturb(pixels[id], left_errs, options.sigma_px, &random);
      observation.right =
          disturb(pixel.value_or(Vector2d::Zero()), right_errs, options.sigma_px, &random);
      frame.observations.push_back(observation);
    }
    frames.push_back(std::move(frame));
  }
  return frames;
}

}  // namespace etalon
