// Registers a class of MRPT's that is no Initializer.
#include <mrpt/core/initializer.h>

#include "etalon/initialization/initializer.h"

namespace etalon::test_plugins {
class WrongBase : public mrpt::rtti::CObject {
  DEFINE_MRPT_OBJECT(WrongBase, etalon::test_plugins)
};
IMPLEMENTS_MRPT_OBJECT(WrongBase, mrpt::rtti::CObject, etalon::test_plugins)
}  // namespace etalon::test_plugins

extern "C" const etalon::InitializerDescriptor* etalon_initializer_descriptor() {
  static const etalon::InitializerDescriptor kDescriptor{
      ETALON_INITIALIZER_ABI, "wrong_base", "etalon::test_plugins::WrongBase", "1.0", "no plugin"};
  return &kDescriptor;
}
MRPT_INITIALIZER(registerWrongBase) {
  mrpt::rtti::registerClass(CLASS_ID(etalon::test_plugins::WrongBase));
}
