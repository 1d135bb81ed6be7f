#include <csignal>

#include "etalon/initialization/initializer.h"

namespace etalon::test_plugins {

class CrashesWhenMade : public Initializer {
  DEFINE_MRPT_OBJECT(CrashesWhenMade, etalon::test_plugins)

 public:
  CrashesWhenMade() {
    std::signal(SIGSEGV, SIG_DFL);  // a sanitizer would make an exit of it
    std::raise(SIGSEGV);
  }
  void declareParameters(ParameterSet& /*parameters*/) override {}
  bool needsVisualSolution() const override { return false; }

 protected:
  InitializationResult solve(const InitializationProblem& /*problem*/) const override {
    return refuse(RefusalStatus::kTooLittleMotion, "polite");
  }
};

IMPLEMENTS_MRPT_OBJECT(CrashesWhenMade, etalon::Initializer, etalon::test_plugins)

}  // namespace etalon::test_plugins

ETALON_REGISTER_INITIALIZER(CrashesWhenMade, etalon::test_plugins, "crashes_when_made", "0.1",
                            "crashes in its constructor")
