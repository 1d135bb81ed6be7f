// Tells MRPT that its base is Initializer, which it is not.
#include <mrpt/core/initializer.h>

#include "etalon/initialization/initializer.h"

namespace etalon::test_plugins {
class LyingBase : public mrpt::rtti::CObject {
  DEFINE_MRPT_OBJECT(LyingBase, etalon::test_plugins)
};
IMPLEMENTS_MRPT_OBJECT(LyingBase, etalon::Initializer, etalon::test_plugins)
}  // namespace etalon::test_plugins

extern "C" const etalon::InitializerDescriptor* etalon_initializer_descriptor() {
  static const etalon::InitializerDescriptor kDescriptor{
      ETALON_INITIALIZER_ABI, "lying_base", "etalon::test_plugins::LyingBase", "1.0", "no plugin"};
  return &kDescriptor;
}
MRPT_INITIALIZER(registerLyingBase) {
  mrpt::rtti::registerClass(CLASS_ID(etalon::test_plugins::LyingBase));
}
