#include "etalon/map/view_search.h"

#include <cmath>

#include "etalon/core/statistics.h"

namespace etalon {

bool ViewFindings::confirmGuess() const {
  return landmarks.size() >= kMinLandmarks &&
         static_cast<double>(landmarks.size()) >= kMinShare * static_cast<double>(asked.size());
}

ViewFindings ViewSearch::find(TimeNs name, const OldView& view,
                              const std::vector<SeenLandmark>& landmarks,
                              const std::vector<size_t>& which) const {
  ViewFindings findings;
  std::vector<ViewQuery> queries;
  for (const size_t l : which)
    if (const auto query =
            predictInView(calibration, view, landmarks[l], sigma_px * std::sqrt(pixel_variance))) {
      queries.push_back(*query);
      findings.asked.push_back(l);
    }
  std::vector<double> reaches;
  for (const ViewQuery& query : queries) reaches.push_back(query.reach_px);
  findings.reach_px = reaches.empty() ? 0.0 : median(std::move(reaches));
  const std::vector<ViewMatch> matches = matcher.find(name, queries);
  std::vector<FoundLandmark> found;
  for (size_t i = 0; i < matches.size(); ++i) {
    if (!matches[i].found) continue;
    if (const auto f = foundLandmark(calibration, findings.asked[i], matches[i], sigma_px))
      found.push_back(*f);
  }
  findings.landmarks = agreeing(calibration, view, landmarks, found, pixel_variance, options);
  for (const FoundLandmark& f : findings.landmarks)
    findings.observations.push_back(
        {landmarks[f.landmark].id, f.match.left, f.match.right, f.match.has_right});
  return findings;
}

}  // namespace etalon
