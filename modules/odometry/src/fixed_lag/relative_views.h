#pragma once

// Every camera at every state of the window as the hosts of landmarks see it. Private to the module.

#include <Eigen/Geometry>
#include <vector>

#include "window.h"

namespace etalon::fixed_lag {

/** The poses that the residuals of all landmarks need, worked out once. */
class RelativeViews {
 public:
  /** A camera at a state: ray_C = R (ray - rho c) of a landmark's ray. R and c are in the host's
   * axes turned to where its linearisation point has those of W; c is from the host. */
  struct View {
    Eigen::Matrix3d R;
    Eigen::Vector3d c;
  };
  /** A landmark from its host, in the same axes. */
  struct Ray {
    Eigen::Matrix3d axes;    ///< of the landmark's parameters
    Eigen::Vector3d origin;  ///< of the landmark's parameters
    Eigen::Vector3d ray;     ///< rho times the position
    double rho;
  };

  RelativeViews() = default;
  explicit RelativeViews(const Window& window) { place(window); }

  /** At the estimates of the window. */
  void place(const Window& window);

  Ray ray(const Landmark& landmark) const {
    const Eigen::Matrix3d& R = turned_[landmark.host];
    const InverseDepthLandmark& in_host = landmark.in_host;
    Ray ray{R * in_host.axes, R * in_host.origin, {}, in_host.parameters.z()};
    ray.ray = ray.axes * in_host.parameters.head<2>().homogeneous() + ray.rho * ray.origin;
    return ray;
  }

  const View& view(int host, int state, size_t camera) const {
    return views_[(host * turned_.size() + state) * 2 + camera];
  }

  /** reprojectionResidual() of one camera of an observation. */
  bool residual(const Ray& ray, int host, const LandmarkObservation& o, size_t camera,
                Eigen::Vector2d* r, Eigen::Matrix<double, 2, 3>* J_ray_C = nullptr) const {
    const View& from = view(host, o.state, camera);
    return reprojectionResidual(o.measurements[camera], from.R * (ray.ray - ray.rho * from.c),
                                ray.rho, r, J_ray_C);
  }

 private:
  std::vector<Eigen::Matrix3d> turned_;  ///< by host: from its axes to those of its views
  std::vector<View> views_;              ///< by host, state and camera
};

}  // namespace etalon::fixed_lag
