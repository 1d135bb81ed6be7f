#include "etalon/optimization/bundle/starting_landmarks.h"

namespace etalon {

StartingLandmarks startingLandmarks(const VisualWindow& window,
                                    const std::map<LandmarkId, Eigen::Vector3d>& known) {
  StartingLandmarks landmarks;
  for (const LandmarkId id : window.landmark_ids) {
    const auto found = known.find(id);
    landmarks.valid.push_back(found != known.end());
    landmarks.positions.push_back(found != known.end() ? found->second
                                                       : Eigen::Vector3d(Eigen::Vector3d::Zero()));
  }
  return landmarks;
}

void triangulateMissing(const VisualWindow& window, const std::vector<SE3>& T_WB,
                        StartingLandmarks* landmarks) {
  for (size_t l = 0; l < landmarks->positions.size(); ++l) {
    if (landmarks->valid[l]) continue;
    if (const auto p_W = triangulate(window, static_cast<int>(l), T_WB)) {
      landmarks->positions[l] = *p_W;
      landmarks->valid[l] = 1;
    }
  }
}

}  // namespace etalon
