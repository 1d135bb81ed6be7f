// Describes a class that it does not register.
#include "etalon/initialization/initializer.h"

extern "C" const etalon::InitializerDescriptor* etalon_initializer_descriptor() {
  static const etalon::InitializerDescriptor kDescriptor{
      ETALON_INITIALIZER_ABI, "unregistered", "etalon::test_plugins::Nowhere", "1.0", "absent"};
  return &kDescriptor;
}
