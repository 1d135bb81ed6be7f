#include <Eigen/Cholesky>
#include <algorithm>
#include <limits>
#include <map>
#include <set>
#include <utility>

#include "etalon/core/stopwatch.h"
#include "etalon/core/symmetric.h"
#include "etalon/initialization/initializer.h"
#include "etalon/initialization/joint/joint_map.h"
#include "etalon/initialization/predicted_errors.h"
#include "etalon/initialization/steps/visual_inertial_problem.h"

namespace etalon::plugins {

using Eigen::MatrixXd;
using Eigen::Vector2d;

namespace {

/** How many keyframes see a landmark with the left camera, and where the middle one of these does. */
struct Track {
  LandmarkId id = -1;
  bool stereo = false;  ///< the right camera sees it, too, in some keyframe
  int length = 0;
  Vector2d pixel = Vector2d::Zero();

  /** The closed form starts from the depth that both cameras show, so that comes first. */
  std::pair<bool, int> rank() const { return {stereo, length}; }
};

std::vector<Track> tracksOf(const InitializationProblem& problem) {
  std::map<LandmarkId, std::vector<Observation>> seen;
  for (const TrackedFrame* frame : problem.keyframes())
    for (const Observation& o : frame->observations) seen[o.id].push_back(o);
  std::vector<Track> tracks;
  for (const auto& [id, all] : seen) {
    const bool stereo =
        std::any_of(all.begin(), all.end(), [](const Observation& o) { return o.has_right; });
    tracks.push_back({id, stereo, static_cast<int>(all.size()), all[all.size() / 2].left});
  }
  return tracks;
}

/** The longest tracks, those with a depth from both cameras before the others; among equals those that
 * are farthest from all that were taken before. */
std::set<LandmarkId> chooseTracks(std::vector<Track> tracks, int count) {
  std::stable_sort(tracks.begin(), tracks.end(),
                   [](const Track& a, const Track& b) { return a.rank() > b.rank(); });
  std::vector<double> distance(tracks.size(), std::numeric_limits<double>::max());
  std::set<LandmarkId> chosen;
  std::vector<char> taken(tracks.size(), 0);
  for (int n = 0; n < count && n < static_cast<int>(tracks.size()); ++n) {
    size_t best = tracks.size();
    for (size_t i = 0; i < tracks.size(); ++i) {
      if (taken[i]) continue;
      if (best < tracks.size() && tracks[i].rank() < tracks[best].rank()) break;
      if (best == tracks.size() || distance[i] > distance[best]) best = i;
    }
    taken[best] = 1;
    chosen.insert(tracks[best].id);
    for (size_t i = 0; i < tracks.size(); ++i)
      distance[i] = std::min(distance[i], (tracks[i].pixel - tracks[best].pixel).norm());
  }
  return chosen;
}

InitializationProblem withTracks(const InitializationProblem& problem,
                                 const std::set<LandmarkId>& chosen) {
  InitializationProblem::Data data = problem.data();
  data.priors.slow_accel = SlowAcceleration();  // the published adjustment knows of none
  for (TrackedFrame& frame : data.frames) {
    const auto dropped = [&](const auto& o) { return chosen.count(o.id) == 0; };
    auto& seen = frame.observations;
    seen.erase(std::remove_if(seen.begin(), seen.end(), dropped), seen.end());
    frame.right_only.clear();
  }
  return InitializationProblem(std::move(data));
}

/** Two rounds, of pixels that are as noisy as sigma_px says and share no errors. */
VisualInertialBaOptions publishedBa() {
  constexpr double kPracticallyNone = 1e-4;
  VisualInertialBaOptions ba;
  ba.rounds = 2;
  ba.least_pixel_share = 1.0;
  ba.sigma_shared_deg = ba.sigma_turn_deg = kPracticallyNone;
  return ba;
}

}  // namespace

/**
 * Campos, Montiel and Tardos, ICRA 2019: the joint closed form on few tracks, bundle adjustment, and
 * two tests that discard what is wrong (README.md beside this file).
 */
class JointMle : public Initializer {
  DEFINE_MRPT_OBJECT(JointMle, etalon::plugins)

 public:
  void declareParameters(ParameterSet& parameters) override {
    parameters.add("tracks", &tracks_, {5, 100000},
                   "Tracks of the closed form and of the bundle adjustment (published: 20).");
    parameters.add("ba_iterations", &ba_.iterations_per_round, {1, 1000},
                   "Iterations of each of the bundle adjustment's two rounds, at most.");
    parameters.add("min_information", &min_information_, {0.0, 1e12},
                   "Refuse if the data alone, without priors, tell some direction of biases, tilt "
                   "and velocity with less information, SI units (published: 0.1).");
    parameters.add("consensus_sigma_px", &consensus_sigma_px_, {0.01, 100.0},
                   "Pixels of the other tracks agree within the 95 % of this standard deviation, "
                   "px.");
    parameters.add(
        "min_consensus", &min_consensus_, {0.0, 1.0},
        "Refuse if a smaller share of the other tracks' pixels agrees (published: 0.9).");
  }
  bool needsVisualSolution() const override { return false; }

 protected:
  InitializationResult solve(const InitializationProblem& problem) const override {
    Stopwatch watch;
    const std::set<LandmarkId> chosen = chooseTracks(tracksOf(problem), tracks_);
    const InitializationProblem few = withTracks(problem, chosen);
    JointMapOptions closed_form;
    closed_form.min_landmarks = std::min(closed_form.min_landmarks, tracks_ / 2);
    closed_form.converged_rps = 5e-3;  // a start for the bundle adjustment
    closed_form.converged_sigmas = std::numeric_limits<double>::infinity();
    closed_form.max_passes = 50;
    closed_form.chi2_pixel = 1000.0;     // the IMU counts as exact: pixels take its errors
    closed_form.min_inlier_share = 0.0;  // the tests judge
    closed_form.model.imu_noise = false;
    closed_form.model.estimate_accel_bias = false;
    closed_form.covariance = false;
    const InitializationResult start = solveJointMap(few, closed_form);
    if (!start) return refuse(start.error());
    const double closed_form_ms = watch.lapMilliseconds();

    VisualInertialProblem vi = visualInertialProblem(few, *start);
    const VisualInertialBaResult refined = solveVisualInertialBa(std::move(vi), ba_);
    if (!refined.summary.usable())
      return refuse(RefusalStatus::kNotConverged, "the bundle adjustment of ", Value(tracks_),
                    " tracks failed: ", refined.summary.message);
    if (!refined.summary.converged())
      return refuse(RefusalStatus::kNotConverged, "the bundle adjustment of ", Value(tracks_),
                    " tracks has not converged after ", refined.summary.iterations, " iterations");
    const double ba_ms = watch.lapMilliseconds();
    if (const auto observable = checkObservability(problem, claimedCovariance(refined));
        !observable)
      return refuse(observable.error());
    if (const auto agreed = checkConsensus(problem, chosen, refined); !agreed)
      return refuse(agreed.error());

    Initialization result;
    for (int k = 0; k < problem.keyframeCount(); ++k)
      result.states.emplace_back(problem.keyframe(k).t, refined.states[k].T_WB,
                                 refined.states[k].v_WB);
    result.bias = refined.bias;
    result.landmarks = refined.bundle.validLandmarks();
    result.covariance = claimedJointCovariance(refined);
    result.timings = {{"closed_form", closed_form_ms},
                      {"bundle_adjustment", ba_ms},
                      {"tests", watch.lapMilliseconds()}};
    return result;
  }

 private:
  /** The weakest direction of the information that is not the priors'. */
  Expected<void> checkObservability(const InitializationProblem& problem,
                                    const MatrixXd& covariance) const {
    double least = 0.0;
    const Eigen::LLT<MatrixXd> factor(covariance);
    if (covariance.rows() == 11 && factor.info() == Eigen::Success) {
      MatrixXd information = factor.solve(MatrixXd::Identity(11, 11));
      const BiasPriors& priors = problem.priors();
      information.diagonal().segment<3>(0).array() -=
          1.0 / (priors.sigma_gyro_rps * priors.sigma_gyro_rps);
      information.diagonal().segment<3>(3).array() -=
          1.0 / (priors.sigma_accel_mps2 * priors.sigma_accel_mps2);
      least = symmetricEigenvalues(information)[0];
    }
    if (least >= min_information_) return {};
    return refuse(RefusalStatus::kIllConditioned,
                  "the data tell the weakest direction of biases, tilt and velocity with an "
                  "information of ",
                  Value(least, 3), ", at least ", Bound(min_information_, 3), " is wanted");
  }

  /** Whether the tracks that had no part agree with the poses. */
  Expected<void> checkConsensus(const InitializationProblem& problem,
                                const std::set<LandmarkId>& chosen,
                                const VisualInertialBaResult& refined) const {
    const VisualWindow window =
        buildVisualWindow(problem.calibration(), problem.keyframes(), consensus_sigma_px_);
    std::vector<SE3> T_WB;
    for (const NavState& state : refined.states) T_WB.push_back(state.T_WB);
    int pixels = 0, agree = 0;
    for (int l = 0; l < window.landmarkCount(); ++l) {
      if (chosen.count(window.landmark_ids[l]) > 0) continue;
      const auto p_W = triangulate(window, l, T_WB);
      for (const VisualMeasurement& m : window.measurementsOf(static_cast<size_t>(l))) {
        Vector2d r;
        ++pixels;
        agree += p_W && window.residual(m, T_WB, *p_W, &r) && r.squaredNorm() < kChi2Pixel;
      }
    }
    const double share = pixels > 0 ? static_cast<double>(agree) / pixels : 1.0;
    if (share >= min_consensus_) return {};
    return refuse(RefusalStatus::kNotConverged, Value(share, 2),
                  " of the other tracks' pixels agree with the poses, at least ",
                  Bound(min_consensus_, 2), " is wanted");
  }

  int tracks_ = 20;
  VisualInertialBaOptions ba_ = publishedBa();
  double min_information_ = 0.1;
  double consensus_sigma_px_ = 1.0;
  double min_consensus_ = 0.9;
};

IMPLEMENTS_MRPT_OBJECT(JointMle, Initializer, etalon::plugins)

}  // namespace etalon::plugins

ETALON_REGISTER_INITIALIZER(JointMle, etalon::plugins, "joint_mle", "1.0",
                            "joint closed form on few tracks, bundle adjustment, tests of "
                            "observability and consensus (Campos et al. 2019)")
