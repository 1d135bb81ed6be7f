#pragma once

#include <functional>
#include <string>

#include "etalon/contract/contract.h"

namespace etalon::testing {

/** Changes the result of a problem. */
using Change = std::function<void(const InitializationProblem&, InitializationResult*)>;

/** A good initializer whose results are spoilt on the way out. */
class Spoilt : public Initializer {
  DEFINE_MRPT_OBJECT(Spoilt, etalon::testing)

 public:
  Spoilt() = default;
  explicit Spoilt(Change change);
  void declareParameters(ParameterSet& parameters) override {
    parameters.add("key", &number_, {0, 9}, documentation_);
  }
  bool needsVisualSolution() const override { return says_needs_; }

  std::string documentation_ = "A number.";
  bool says_needs_ = true;

 protected:
  InitializationResult solve(const InitializationProblem& problem) const override {
    InitializationResult result = good_->initialize(problem);
    change_(problem, &result);
    return result;
  }

 private:
  Initializer::Ptr good_;
  Change change_ = [](const InitializationProblem&, InitializationResult*) {};
  int number_ = 1;
};

/** A change of successes alone. */
Change ofSuccess(const std::function<void(Initialization*)>& change);

/** The verdict of one check. */
ContractCheck check(const std::string& name, const Initializer& initializer,
                    ContractOptions options = {});

}  // namespace etalon::testing
