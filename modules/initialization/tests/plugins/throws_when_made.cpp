#include "test_initializer.h"

namespace etalon::test_plugins {
class ThrowsWhenMade : public TestInitializer {
  DEFINE_MRPT_OBJECT(ThrowsWhenMade, etalon::test_plugins)
 public:
  ThrowsWhenMade() { throw std::runtime_error("no licence found"); }
};
IMPLEMENTS_MRPT_OBJECT(ThrowsWhenMade, etalon::Initializer, etalon::test_plugins)
}  // namespace etalon::test_plugins

ETALON_REGISTER_INITIALIZER(ThrowsWhenMade, etalon::test_plugins, "throws_when_made", "1.0", "x")
