#pragma once

#include <string>
#include <vector>

#include "etalon/benchmark/vision_check.h"
#include "etalon/ground_truth/smoothing.h"
#include "etalon/report/table.h"

namespace etalon {

/** What is wrong with a recording's ground truth. */
struct GroundTruthJudgement {
  std::string name;  ///< the recording's
  GroundTruthSmoothing found;
  VisionCheck vision;  ///< no windows: not checked by images
};

/** What is significant (2.5 standard errors), in words. */
std::string inWords(const GroundTruthSmoothing& found);

/** The page that `etalon ground-truth` prints: lines of at most 100 characters, tables with a row a
 * recording, then what is wrong in words. */
std::string groundTruthPage(const std::vector<GroundTruthJudgement>& all);

/** All that was found, with the corrected trajectory drawn against the recorded one: one HTML file
 * that needs no other file and no network. */
std::string groundTruthReportHtml(const GroundTruthJudgement& judgement,
                                  const GroundTruth& recorded);

}  // namespace etalon
