#pragma once

#include <nlohmann/json.hpp>

#include "etalon/runlog/initialization_json.h"
#include "etalon/runlog/json_reader.h"

namespace etalon {

/** nlohmann writes what is not finite as null by itself; this says so. */
nlohmann::ordered_json numberJson(double value);

template <typename Vector>
nlohmann::ordered_json vectorJson(const Vector& v) {
  nlohmann::ordered_json json = nlohmann::ordered_json::array();
  for (Eigen::Index i = 0; i < v.size(); ++i) json.push_back(numberJson(v[i]));
  return json;
}

/** Errors, states and attempts as they stand in the JSON of runs and benchmarks; a covariance that
 * is empty is left out. */
nlohmann::ordered_json stateJson(const KeyframeState& state);
KeyframeState stateFromJson(const JsonReader& json);
nlohmann::ordered_json attemptJson(const AttemptRecord& attempt);
AttemptRecord attemptFromJson(const JsonReader& json);

}  // namespace etalon
