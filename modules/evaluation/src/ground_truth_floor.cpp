#include "etalon/evaluation/ground_truth_floor.h"

namespace etalon {

GroundTruthFloor groundTruthFloor(const GroundTruth&, const std::vector<ImuSample>&, double) {
  return {};
}

}  // namespace etalon
