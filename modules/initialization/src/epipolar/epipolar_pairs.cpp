#include "epipolar/epipolar_pairs.h"

#include <algorithm>
#include <utility>

namespace etalon {
namespace {

using Eigen::Vector3d;

struct Bearing {
  LandmarkId id;
  int observation;  ///< number of the observation in the window
  Vector3d f;
};

/** Bearings of a keyframe in a camera, in increasing order of id; they go on counting. */
std::vector<Bearing> bearingsOf(const CameraModel& camera, int index, const TrackedFrame& frame,
                                int* observations) {
  std::vector<Bearing> bearings;
  for (const Observation& o : frame.observations) {
    if (index == 1 && !o.has_right) continue;
    if (const auto ray = camera.unproject(index == 0 ? o.left : o.right))
      bearings.push_back({o.id, (*observations)++, ray->normalized()});
  }
  return bearings;
}

std::vector<EpipolarMatch> matchesOf(const std::vector<Bearing>& a, const std::vector<Bearing>& b) {
  std::vector<EpipolarMatch> matches;
  for (size_t i = 0, j = 0; i < a.size() && j < b.size();) {
    if (a[i].id == b[j].id) matches.push_back({a[i].observation, b[j].observation, a[i].f, b[j].f});
    const bool first = a[i].id <= b[j].id, second = b[j].id <= a[i].id;
    if (first) ++i;
    if (second) ++j;
  }
  return matches;
}

/** Thins the matches evenly to at most `count`. */
void thin(size_t count, std::vector<EpipolarMatch>* matches) {
  if (matches->size() <= count) return;
  for (size_t k = 0; k < count; ++k) (*matches)[k] = (*matches)[k * matches->size() / count];
  matches->resize(count);
}

}  // namespace

EpipolarPairs collectEpipolarPairs(const StereoInertialCalibration& calibration,
                                   const std::vector<const TrackedFrame*>& keyframes,
                                   const NormalEpipolarBiasOptions& options) {
  const int n = keyframes.size();
  EpipolarPairs found;
  std::vector<int> neighbours(keyframes.size() - 1, 0);
  for (int camera = 0; camera < (options.both_cameras ? 2 : 1); ++camera) {
    std::vector<std::vector<Bearing>> bearings;
    for (const TrackedFrame* frame : keyframes)
      bearings.push_back(
          bearingsOf(calibration.cameras[camera].model, camera, *frame, &found.observations));
    for (int i = 0; i < n; ++i)
      for (int j = i + 1; j < (options.all_pairs ? n : std::min(n, i + 2)); ++j) {
        EpipolarPair pair;
        pair.i = i;
        pair.j = j;
        pair.camera = camera;
        pair.matches = matchesOf(bearings[i], bearings[j]);
        const int count = pair.matches.size();
        if (j == i + 1) neighbours[i] = std::max(neighbours[i], count);
        if (count < options.min_matches) continue;
        if (j > i + 1) thin(options.max_matches, &pair.matches);
        found.pairs.push_back(std::move(pair));
      }
  }
  found.fewest_matches = *std::min_element(neighbours.begin(), neighbours.end());
  std::stable_sort(
      found.pairs.begin(), found.pairs.end(),
      [](const EpipolarPair& a, const EpipolarPair& b) { return a.j - a.i < b.j - b.i; });
  return found;
}

}  // namespace etalon
