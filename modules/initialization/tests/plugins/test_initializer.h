#pragma once

#include <cmath>
#include <stdexcept>

#include "etalon/core/errors.h"
#include "etalon/initialization/initializer.h"

namespace etalon::test_plugins {

/** Answers with the keyframes at rest at the origin, or misbehaves as its parameter says. */
class TestInitializer : public Initializer {
 public:
  void declareParameters(ParameterSet& parameters) override {
    parameters.add("answer", &answer_,
                   {{"rest", Answer::kRest},
                    {"nan", Answer::kNan},
                    {"few_states", Answer::kFewStates},
                    {"skewed", Answer::kSkewed},
                    {"silent", Answer::kSilent},
                    {"error", Answer::kError},
                    {"data_error", Answer::kDataError},
                    {"exception", Answer::kException},
                    {"integer", Answer::kInteger}},
                   "What solve() does.");
    parameters.add("sigma_px", &sigma_px_, {0.1, 10.0}, "A number.");
  }
  bool needsVisualSolution() const override { return false; }

 protected:
  InitializationResult solve(const InitializationProblem& problem) const override {
    if (answer_ == Answer::kError) throw Error("a refusal thrown by the plugin");
    if (answer_ == Answer::kDataError) throw DataError("imu.csv", 7, "a broken line");
    if (answer_ == Answer::kException) throw std::out_of_range("an exception of the plugin");
    if (answer_ == Answer::kInteger) throw 42;
    if (answer_ == Answer::kSilent) return refuse(RefusalStatus::kTooLittleMotion);
    Initialization result;
    for (int k = 0; k < problem.keyframeCount(); ++k) {
      result.states.push_back({problem.keyframe(k).t, SE3(), Eigen::Vector3d::Zero()});
    }
    if (answer_ == Answer::kNan) result.states.back().v_WB.y() = std::nan("");
    if (answer_ == Answer::kSkewed) result.states.back().T_WB.R *= 1.001;
    if (answer_ == Answer::kFewStates) result.states.pop_back();
    return result;
  }

 private:
  enum class Answer {
    kRest,
    kNan,
    kFewStates,
    kSkewed,
    kSilent,
    kError,
    kDataError,
    kException,
    kInteger
  };

  Answer answer_ = Answer::kRest;
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
