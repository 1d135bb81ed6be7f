#pragma once

#include <string>
#include <vector>

#include "etalon/contract/contract.h"
#include "etalon/contract/synthetic_window.h"
#include "spoilt.h"

namespace etalon::testing {

/**
 * Knows the windows that the contract asks about and says the truth, as `change` leaves it, in no
 * time. The world of its answer may be another one than the window's: turned about z and moved.
 */
class TruthTeller : public Initializer {
  DEFINE_MRPT_OBJECT(TruthTeller, etalon::testing)

 public:
  TruthTeller() = default;
  explicit TruthTeller(Change change) : change_(std::move(change)) {}
  void declareParameters(ParameterSet& parameters) override {
    if (declare_) declare_(parameters);
  }
  bool needsVisualSolution() const override { return says_needs_; }

  std::function<void(ParameterSet&)> declare_;
  bool says_needs_ = false;

 protected:
  InitializationResult solve(const InitializationProblem& problem) const override;

 private:
  Change change_ = [](const InitializationProblem&, InitializationResult*) {};
};

/** The motion of the window that the problem was made of. */
Motion motionOf(const InitializationProblem& problem);

/** A change of the answers about one motion. */
Change onlyFor(Motion motion, const Change& change);

/** A change that refuses. */
Change refusing(const std::string& reason);

/** The verdict of one check in this process. */
ContractCheck checkHere(const std::string& name, const Initializer& initializer,
                        ContractOptions options = {});

}  // namespace etalon::testing
