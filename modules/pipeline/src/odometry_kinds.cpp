#include "odometry_kinds.h"

#include <algorithm>
#include <array>

#include "etalon/core/errors.h"
#include "etalon/odometry/fixed_lag/fixed_lag_odometry.h"
#include "etalon/odometry/stereo_visual_odometry.h"

namespace etalon {
namespace {

struct OdometryKind {
  const char* name;
  const char* words;
  std::unique_ptr<Odometry> (*make)(const StereoInertialCalibration&, const PipelineOptions&,
                                    const std::shared_ptr<ViewMatcher>&);
};

std::unique_ptr<Odometry> makeFixedLag(const StereoInertialCalibration& calibration,
                                       const PipelineOptions& options,
                                       const std::shared_ptr<ViewMatcher>& views) {
  return std::make_unique<FixedLagOdometry>(calibration, options.fixed_lag, options.map, views);
}

std::unique_ptr<Odometry> makeStereoVisual(const StereoInertialCalibration& calibration,
                                           const PipelineOptions& options,
                                           const std::shared_ptr<ViewMatcher>& /*views*/) {
  return std::make_unique<StereoVisualOdometry>(calibration, options.window.odometry,
                                                KeyframeSelectorOptions{options.keyframe_rate_hz});
}

const std::array kOdometryKinds = {
    OdometryKind{kFixedLag, "images and IMU, tightly coupled", makeFixedLag},
    OdometryKind{kStereoVisual, "images alone", makeStereoVisual},
};

}  // namespace

std::vector<std::string> odometryKinds() {
  std::vector<std::string> names;
  for (const OdometryKind& kind : kOdometryKinds) names.emplace_back(kind.name);
  return names;
}

std::string odometryKindsInWords() {
  std::string text;
  for (const OdometryKind& kind : kOdometryKinds) {
    if (!text.empty()) text += &kind == &kOdometryKinds.back() ? " or " : ", ";
    text += std::string(kind.name) + " (" + kind.words + ")";
  }
  return text;
}

std::unique_ptr<Odometry> makeOdometry(const std::string& name,
                                       const StereoInertialCalibration& calibration,
                                       const PipelineOptions& options,
                                       const std::shared_ptr<ViewMatcher>& views) {
  const auto kind = std::find_if(kOdometryKinds.begin(), kOdometryKinds.end(),
                                 [&name](const OdometryKind& k) { return name == k.name; });
  if (kind == kOdometryKinds.end())
    throw ConfigError("[odometry] kind = '" + name + "': expected " + odometryKindsInWords());
  return kind->make(calibration, options, views);
}

}  // namespace etalon
