#pragma once

// Old views of a simulated flight: where they truly show its landmarks, with noise. For the tests
// and benchmarks of odometry.

#include <algorithm>
#include <random>

#include "etalon/map/view_matcher.h"
#include "simulated_flight.h"

namespace etalon {

class SimulatedViews : public ViewMatcher {
 public:
  /**
   * @param sigma_px of a pixel, drawn once for every landmark and view: who looks again finds the
   *        same
   * @param wrong share of the landmarks of a view that are found up to 8 px from where they are
   */
  SimulatedViews(const SimulatedFlight& flight, double sigma_px, double wrong = 0.0)
      : flight_(&flight), sigma_px_(sigma_px), wrong_(wrong) {}

  bool keep(TimeNs view) override {
    views_.push_back(view);
    return true;
  }
  void dropAllBut(const std::vector<TimeNs>& views) override { views_ = views; }
  std::vector<ViewMatch> find(TimeNs view, const std::vector<ViewQuery>& queries) override {
    std::vector<ViewMatch> matches(queries.size());
    const auto& frames = flight_->frames;
    const auto frame = std::lower_bound(frames.begin(), frames.end(), view,
                                        [](const TrackedFrame& f, TimeNs t) { return f.t < t; });
    const SE3 T_BW = flight_->truth[frame - frames.begin()].T_WB.inverse();
    for (size_t i = 0; i < queries.size(); ++i) {
      const Eigen::Vector3d p_B = T_BW * flight_->landmarks[queries[i].id];
      std::mt19937_64 generator(static_cast<std::uint64_t>(view) * 2003 +
                                static_cast<std::uint64_t>(queries[i].id));
      const bool wrong = std::uniform_real_distribution<double>()(generator) < wrong_;
      const auto seen = [&](size_t camera) -> std::optional<Eigen::Vector2d> {
        const CameraCalibration& c = flight_->calibration.cameras[camera];
        auto pixel = c.model.project(c.T_BC.inverse() * p_B);
        std::normal_distribution<double> normal(0.0, sigma_px_);
        const Eigen::Vector2d noise(normal(generator), normal(generator));
        if (!pixel || !c.model.inImage(*pixel)) return std::nullopt;
        return *pixel + noise;
      };
      const auto left = seen(0), right = seen(1);
      std::uniform_real_distribution<double> off(-8.0, 8.0);
      const Eigen::Vector2d error =
          wrong ? Eigen::Vector2d(off(generator), off(generator)) : Eigen::Vector2d::Zero();
      matches[i].found = left.has_value();
      matches[i].has_right = left && right;
      if (left) matches[i].left = *left + error;
      if (right) matches[i].right = *right + error;
    }
    return matches;
  }

  size_t views() const { return views_.size(); }

 private:
  const SimulatedFlight* flight_;
  double sigma_px_, wrong_;
  std::vector<TimeNs> views_;
};

}  // namespace etalon
