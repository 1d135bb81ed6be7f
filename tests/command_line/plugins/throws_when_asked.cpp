#include <stdexcept>

#include "etalon/initialization/initializer.h"

namespace etalon::test_plugins {

/** With `initializer = auto`, after an initializer at rest that asked for stereo odometry: throws
 * where nobody catches what an initializer throws. */
class ThrowsWhenAsked : public Initializer {
  DEFINE_MRPT_OBJECT(ThrowsWhenAsked, etalon::test_plugins)

 public:
  void declareParameters(ParameterSet& /*parameters*/) override {}
  bool needsVisualSolution() const override { throw std::runtime_error("thrown in flight"); }

 protected:
  InitializationResult solve(const InitializationProblem& /*problem*/) const override {
    return refuse(Refusal());
  }
};

IMPLEMENTS_MRPT_OBJECT(ThrowsWhenAsked, etalon::Initializer, etalon::test_plugins)

}  // namespace etalon::test_plugins

ETALON_REGISTER_INITIALIZER(ThrowsWhenAsked, etalon::test_plugins, "throws_when_asked", "0.1",
                            "throws when it is asked")
