#include <csignal>

#include "etalon/initialization/initializer.h"

namespace etalon::test_plugins {

/** Is loaded and described without a word, and kills the process that asks it. */
class CrashesWhenAsked : public Initializer {
  DEFINE_MRPT_OBJECT(CrashesWhenAsked, etalon::test_plugins)

 public:
  void declareParameters(ParameterSet& parameters) override {
    parameters.add("politely", &politely_, "Refuse without a reason instead.");
  }
  bool needsVisualSolution() const override { return false; }

 protected:
  InitializationResult solve(const InitializationProblem& /*problem*/) const override {
    if (!politely_) {
      std::signal(SIGSEGV, SIG_DFL);  // a sanitizer would make an exit of it
      std::raise(SIGSEGV);
    }
    return refuse(Refusal());
  }

 private:
  bool politely_ = false;
};

IMPLEMENTS_MRPT_OBJECT(CrashesWhenAsked, etalon::Initializer, etalon::test_plugins)

}  // namespace etalon::test_plugins

ETALON_REGISTER_INITIALIZER(CrashesWhenAsked, etalon::test_plugins, "crashes_when_asked", "0.1",
                            "crashes when it is asked")
