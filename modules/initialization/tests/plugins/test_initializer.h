#pragma once

#include <cmath>
#include <stdexcept>
#include <string>

#include "etalon/core/errors.h"
#include "etalon/initialization/initializer.h"

namespace etalon::test_plugins {

/** Answers with the keyframes at rest at the origin, or misbehaves as its parameter says. */
class TestInitializer : public Initializer {
 public:
  void declareParameters(ParameterSet& parameters) override {
    parameters.add("answer", &answer_,
                   {"rest", "nan", "few_states", "skewed", "silent", "error", "data_error",
                    "exception", "integer"},
                   "What solve() does.");
    parameters.add("sigma_px", &sigma_px_, {0.1, 10.0}, "A number.");
  }
  bool needsVisualSolution() const override { return false; }

 protected:
  InitializationResult solve(const InitializationProblem& problem) const override {
    if (answer_ == "error") throw Error("a refusal thrown by the plugin");
    if (answer_ == "data_error") throw DataError("imu.csv", 7, "a broken line");
    if (answer_ == "exception") throw std::out_of_range("an exception of the plugin");
    if (answer_ == "integer") throw 42;
    if (answer_ == "silent") return refuse(RefusalStatus::kTooLittleMotion);
    Initialization result;
    for (int k = 0; k < problem.keyframeCount(); ++k) {
      result.states.push_back({problem.keyframe(k).t, SE3(), Eigen::Vector3d::Zero()});
    }
    if (answer_ == "nan") result.states.back().v_WB.y() = std::nan("");
    if (answer_ == "skewed") result.states.back().T_WB.R *= 1.001;
    if (answer_ == "few_states") result.states.pop_back();
    return result;
  }

 private:
  std::string answer_ = "rest";
  double sigma_px_ = 1.0;
};

}  // namespace etalon::test_plugins

/** A class CLASS in etalon::test_plugins that does what TestInitializer does. */
#define ETALON_TEST_INITIALIZER(CLASS)                                     \
  namespace etalon::test_plugins {                                         \
  class CLASS : public TestInitializer {                                   \
    DEFINE_MRPT_OBJECT(CLASS, etalon::test_plugins)                        \
  };                                                                       \
  IMPLEMENTS_MRPT_OBJECT(CLASS, etalon::Initializer, etalon::test_plugins) \
  }
