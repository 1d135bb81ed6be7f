#include "track_statistics.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <map>
#include <optional>

#include "etalon/core/so3.h"
#include "etalon/core/statistics.h"

namespace etalon {

namespace {

/** One pixel of a landmark, with the camera that saw it. */
struct Sighting {
  size_t frame = 0;
  int age = 0;
  size_t camera = 0;
  Eigen::Vector2d pixel = Eigen::Vector2d::Zero();
  SE3 T_CW;
};

constexpr int kAgeBins[][2] = {{0, 0}, {1, 1}, {2, 4}, {5, 9}, {10, 19}, {20, 29}, {30, kMaxAge}};
constexpr int kIterations = 12;
constexpr size_t kLeastSightings = 6;
constexpr double kCauchyPx = 1.0;  ///< scale of the robust loss of the fits
/// Least angle (rad) between two rays for a landmark to be judged: 20 px of parallax.
constexpr double kLeastParallax = 0.04;

/**
 * Inverse-depth fit in the frame of the first left camera: (x, y, 1) / w with w the inverse depth.
 * With `ray_fixed` only w moves. Gauss-Newton with Cauchy weights.
 */
class LandmarkFit {
 public:
  LandmarkFit(const StereoInertialCalibration& calibration, const std::vector<Sighting>& sightings)
      : calibration_(calibration), sightings_(sightings), T_WC_(sightings.front().T_CW.inverse()) {}

  std::optional<Eigen::Vector2d> residual(const Sighting& s,
                                          Eigen::Matrix<double, 2, 3>* J = nullptr) const {
    const SE3 T = s.T_CW * T_WC_;
    const Eigen::Vector3d scaled = T.R * ray() + m_.z() * T.t;
    Eigen::Matrix<double, 2, 3> J_p;
    const auto pixel = calibration_.cameras[s.camera].model.project(scaled, &J_p);
    if (!pixel) return std::nullopt;
    if (J) *J << J_p * T.R * R_CM_.leftCols<2>(), J_p * T.t;
    return *pixel - s.pixel;
  }

  bool solve(bool ray_fixed) {
    const auto direction = calibration_.cameras[0].model.measure(sightings_.front().pixel);
    if (!direction) return false;
    R_CM_ = direction->R_MC.transpose();
    m_ << direction->xy, 0.2;
    for (int iteration = 0; iteration < kIterations; ++iteration) {
      Eigen::Matrix3d H = 1e-9 * Eigen::Matrix3d::Identity();
      Eigen::Vector3d b = Eigen::Vector3d::Zero();
      for (const Sighting& s : sightings_) {
        Eigen::Matrix<double, 2, 3> J;
        const auto r = residual(s, &J);
        if (!r) continue;
        // The first passes are nearly unweighted, so that a far start is not taken for an outlier.
        const double scale = kCauchyPx * std::max(1.0, 64.0 / (1 << std::min(iteration, 20)));
        const double weight = 1.0 / (1.0 + r->squaredNorm() / (scale * scale));
        H += weight * J.transpose() * J;
        b -= weight * J.transpose() * *r;
      }
      if (ray_fixed)
        m_.z() += b.z() / H(2, 2);
      else
        m_ += H.ldlt().solve(b);
      m_.z() = std::clamp(m_.z(), 1e-3, 10.0);
    }
    return m_.allFinite();
  }

  Eigen::Vector3d point() const { return T_WC_ * Eigen::Vector3d(ray() / m_.z()); }

 private:
  Eigen::Vector3d ray() const { return R_CM_ * Eigen::Vector3d(m_.x(), m_.y(), 1.0); }

  const StereoInertialCalibration& calibration_;
  const std::vector<Sighting>& sightings_;
  SE3 T_WC_;
  Eigen::Matrix3d R_CM_ = Eigen::Matrix3d::Identity();  ///< of the first sighting
  Eigen::Vector3d m_ = Eigen::Vector3d::Zero();         ///< x/z, y/z in M, 1/z (1/m)
};

/** Greatest angle between the first ray and another one, from the poses alone. */
double parallax(const StereoInertialCalibration& calibration,
                const std::vector<Sighting>& sightings) {
  const SE3 T_WC = sightings.front().T_CW.inverse();
  const auto& camera = calibration.cameras;
  const auto ray = [&](const Sighting& s) -> Eigen::Vector3d {
    const auto ray_C = camera[s.camera].model.unproject(s.pixel);
    return ray_C ? (s.T_CW.R.transpose() * *ray_C).normalized().eval() : T_WC.R.col(2).eval();
  };
  const Eigen::Vector3d first = ray(sightings.front());
  double greatest = 0.0;
  for (const Sighting& s : sightings)
    greatest = std::max(greatest, std::acos(std::clamp(first.dot(ray(s)), -1.0, 1.0)));
  return greatest;
}

std::map<LandmarkId, std::vector<Sighting>> collectTracks(
    const StereoInertialCalibration& calibration, const std::vector<TrackedFrame>& frames,
    const std::vector<SE3>& T_WB) {
  std::map<LandmarkId, std::vector<Sighting>> tracks;
  std::map<LandmarkId, size_t> born;
  const std::array<SE3, 2> T_CB = {calibration.cameras[0].T_BC.inverse(),
                                   calibration.cameras[1].T_BC.inverse()};
  for (size_t i = 0; i < frames.size(); ++i) {
    const std::array<SE3, 2> T_CW = {T_CB[0] * T_WB[i].inverse(), T_CB[1] * T_WB[i].inverse()};
    for (const Observation& o : frames[i].observations) {
      const int age = static_cast<int>(i - born.emplace(o.id, i).first->second);
      if (age > kMaxAge) continue;
      tracks[o.id].push_back({i, age, 0, o.left, T_CW[0]});
      if (o.has_right) tracks[o.id].push_back({i, age, 1, o.right, T_CW[1]});
    }
  }
  return tracks;
}

struct Errors {
  std::vector<double> drift, left, right;
};

void judgeShares(const std::vector<TrackedFrame>& frames, const std::vector<int>& keyframes,
                 TrackReport* report) {
  std::vector<double> landmarks, stereo;
  for (const TrackedFrame& frame : frames) {
    landmarks.push_back(static_cast<double>(frame.observations.size()));
    double with_right = 0;
    for (const Observation& o : frame.observations) with_right += o.has_right;
    if (!frame.observations.empty()) stereo.push_back(with_right / landmarks.back());
  }
  report->median_landmarks = median(landmarks);
  report->least_landmarks =
      landmarks.empty() ? 0.0 : *std::min_element(landmarks.begin(), landmarks.end());
  report->stereo_share = median(stereo);
  const auto ids = [&](size_t k) {
    std::vector<LandmarkId> result;
    for (const Observation& o : frames[keyframes[k]].observations) result.push_back(o.id);
    return result;
  };
  for (const int step : kSteps) {
    std::vector<double> shares;
    for (size_t k = 0; k + static_cast<size_t>(step) < keyframes.size(); ++k) {
      const auto a = ids(k), b = ids(k + step);
      std::vector<LandmarkId> common;
      std::set_intersection(a.begin(), a.end(), b.begin(), b.end(), std::back_inserter(common));
      if (!a.empty())
        shares.push_back(static_cast<double>(common.size()) / static_cast<double>(a.size()));
    }
    report->shared.push_back(median(shares));
  }
}

}  // namespace

ErrorSummary summarize(const std::vector<double>& errors) {
  ErrorSummary s;
  s.count = errors.size();
  if (errors.empty()) return s;
  s.median = quantile(errors, 0.5);
  s.percentile_68 = quantile(errors, 0.68);
  s.percentile_95 = quantile(errors, 0.95);
  const auto above = std::count_if(errors.begin(), errors.end(), [](double e) { return e > 3.0; });
  s.outlier_share = static_cast<double>(above) / static_cast<double>(errors.size());
  return s;
}

TrackReport judgeTracks(const StereoInertialCalibration& calibration,
                        const std::vector<TrackedFrame>& frames, const std::vector<SE3>& T_WB,
                        const std::vector<int>& keyframes) {
  const auto tracks = collectTracks(calibration, frames, T_WB);
  std::map<int, Errors> by_age;
  Errors all;
  std::vector<double> left_coordinates, right_coordinates;
  for (const auto& [id, sightings] : tracks) {
    if (sightings.size() < kLeastSightings || parallax(calibration, sightings) < kLeastParallax)
      continue;
    LandmarkFit anchored(calibration, sightings), free(calibration, sightings);
    if (!anchored.solve(true) || !free.solve(false)) continue;
    for (const Sighting& s : sightings) {
      const auto r_anchored = anchored.residual(s), r_free = free.residual(s);
      if (!r_anchored || !r_free) continue;
      Errors& bin = by_age[s.age];
      if (s.camera == 0) bin.drift.push_back(r_anchored->norm());
      (s.camera == 0 ? bin.left : bin.right).push_back(r_free->norm());
      auto& coordinates = s.camera == 0 ? left_coordinates : right_coordinates;
      coordinates.push_back(std::abs(r_free->x()));
      coordinates.push_back(std::abs(r_free->y()));
    }
  }
  const auto append = [](std::vector<double>* to, const std::vector<double>& from) {
    to->insert(to->end(), from.begin(), from.end());
  };
  TrackReport report;
  for (const auto& bin : kAgeBins) {
    Errors errors;
    for (int age = bin[0]; age <= bin[1]; ++age) {
      append(&errors.drift, by_age[age].drift);
      append(&errors.left, by_age[age].left);
      append(&errors.right, by_age[age].right);
    }
    report.ages.push_back(
        {bin[0], bin[1], summarize(errors.drift), summarize(errors.left), summarize(errors.right)});
    append(&all.drift, errors.drift);
    append(&all.left, errors.left);
    append(&all.right, errors.right);
  }
  report.drift = summarize(all.drift), report.left = summarize(all.left),
  report.right = summarize(all.right);
  constexpr double kMadToSigma = 1.4826;  // of a normal distribution
  report.left_sigma = kMadToSigma * median(left_coordinates);
  report.right_sigma = kMadToSigma * median(right_coordinates);
  judgeShares(frames, keyframes, &report);
  return report;
}

std::vector<SE3> refinePoses(const StereoInertialCalibration& calibration,
                             const std::vector<TrackedFrame>& frames, std::vector<SE3> T_WB,
                             int rounds) {
  struct PoseSighting {
    Eigen::Vector3d p_W;
    size_t camera;
    Eigen::Vector2d pixel;
  };
  for (int round = 0; round < rounds; ++round) {
    std::vector<std::vector<PoseSighting>> seen(frames.size());
    for (const auto& [id, sightings] : collectTracks(calibration, frames, T_WB)) {
      LandmarkFit fit(calibration, sightings);
      if (sightings.size() < kLeastSightings || !fit.solve(false)) continue;
      for (const Sighting& s : sightings) seen[s.frame].push_back({fit.point(), s.camera, s.pixel});
    }
    for (size_t i = 0; i < frames.size(); ++i) {
      Eigen::Matrix<double, 6, 6> H = 1e-6 * Eigen::Matrix<double, 6, 6>::Identity();
      Eigen::Matrix<double, 6, 1> b = Eigen::Matrix<double, 6, 1>::Zero();
      for (const PoseSighting& s : seen[i]) {
        const SE3 T_CB = calibration.cameras[s.camera].T_BC.inverse();
        const Eigen::Vector3d p_B = T_WB[i].inverse() * s.p_W;
        Eigen::Matrix<double, 2, 3> J_p;
        const auto pixel = calibration.cameras[s.camera].model.project(T_CB * p_B, &J_p);
        if (!pixel) continue;
        // R Exp(d), t + R e: p_B moves by hat(p_B) d - e.
        Eigen::Matrix<double, 2, 6> J;
        J << J_p * T_CB.R * hat(p_B), -J_p * T_CB.R;
        const Eigen::Vector2d r = *pixel - s.pixel;
        const double weight = 1.0 / (1.0 + r.squaredNorm() / (kCauchyPx * kCauchyPx));
        H += weight * J.transpose() * J;
        b -= weight * J.transpose() * r;
      }
      const Eigen::Matrix<double, 6, 1> step = H.ldlt().solve(b);
      T_WB[i] = T_WB[i] * SE3(expSO3(step.head<3>()), step.tail<3>());
    }
  }
  return T_WB;
}

std::string toText(const TrackReport& report) {
  std::string text;
  char line[200];
  const auto cells = [](const ErrorSummary& s) {
    char cell[64];
    std::snprintf(cell, sizeof cell, " | %5.2f %5.2f %5.2f %5.1f%%", s.median, s.percentile_68,
                  s.percentile_95, 100.0 * s.outlier_share);
    return std::string(cell);
  };
  text +=
      "age, frames   count | drift: 50% 68% 95% >3px    | left: 50% 68% 95% >3px     | right: 50% "
      "68% 95% >3px\n";
  for (const AgeRow& row : report.ages) {
    std::snprintf(line, sizeof line, "%3d..%-3d %10zu", row.first_age, row.last_age,
                  row.left.count);
    text += line + cells(row.drift) + cells(row.left) + cells(row.right) + "\n";
  }
  std::snprintf(line, sizeof line, "all %15zu", report.left.count);
  text += line + cells(report.drift) + cells(report.left) + cells(report.right) + "\n";
  std::snprintf(line, sizeof line, "sigma of a coordinate, px: left %.3f, right %.3f\n",
                report.left_sigma, report.right_sigma);
  text += line;
  std::snprintf(line, sizeof line,
                "landmarks a frame: median %.0f, least %.0f; with a right pixel %.1f%%; shared "
                "with keyframe k+1 "
                "%.1f%%, k+4 %.1f%%, k+9 %.1f%%\n",
                report.median_landmarks, report.least_landmarks, 100.0 * report.stereo_share,
                100.0 * report.shared[0], 100.0 * report.shared[1], 100.0 * report.shared[2]);
  return text + line;
}

}  // namespace etalon
