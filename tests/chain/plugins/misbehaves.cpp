#include <unistd.h>

#include <csignal>
#include <cstdlib>

#include "etalon/initialization/initializer.h"

namespace etalon::test_plugins {

/** Refuses politely, but for the windows that begin within a time: there it does as it is told. */
class Misbehaves : public Initializer {
  DEFINE_MRPT_OBJECT(Misbehaves, etalon::test_plugins)

 public:
  void declareParameters(ParameterSet& parameters) override {
    parameters.add("how", &how_, {"segfault", "abort", "exit", "loop", "wait", "escape"},
                   "What it does.");
    parameters.add("begin_s", &begin_s_, {0.0, 1e12}, "First stamp, s.");
    parameters.add("end_s", &end_s_, {0.0, 1e12}, "Last stamp, s.");
  }
  bool needsVisualSolution() const override { return false; }

 protected:
  InitializationResult solve(const InitializationProblem& problem) const override {
    const double t = 1e-9 * static_cast<double>(problem.keyframe(0).t);
    const bool now = begin_s_ <= t && t <= end_s_;
    if (now && how_ == "segfault") {
      std::signal(SIGSEGV, SIG_DFL);  // a sanitizer would make an exit of it
      std::raise(SIGSEGV);
    }
    if (now && how_ == "abort") std::abort();
    if (now && how_ == "exit") std::exit(0);
    if (now && how_ == "loop")
      for (volatile unsigned i = 0;; i = i + 1) {
      }
    if (now && how_ == "wait")
      for (;;) pause();
    return refuse(RefusalStatus::kTooLittleMotion,
                  now && how_ == "escape" ? "\x1b[31mred <b>alarm</b>\x1b[0m" : "polite");
  }

 private:
  std::string how_ = "segfault";
  double begin_s_ = 0.0, end_s_ = 1e12;
};

IMPLEMENTS_MRPT_OBJECT(Misbehaves, etalon::Initializer, etalon::test_plugins)

}  // namespace etalon::test_plugins

ETALON_REGISTER_INITIALIZER(Misbehaves, etalon::test_plugins, "misbehaves", "0.1",
                            "does \x1b[31mwhat it is told")
