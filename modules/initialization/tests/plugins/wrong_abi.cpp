// Says that it was built for ABI 999. Its other members would crash whoever read them.
#include "etalon/initialization/initializer.h"

extern "C" const etalon::InitializerDescriptor* etalon_initializer_descriptor() {
  static const etalon::InitializerDescriptor kDescriptor{
      999, reinterpret_cast<const char*>(1), reinterpret_cast<const char*>(1),
      reinterpret_cast<const char*>(1), reinterpret_cast<const char*>(1)};
  return &kDescriptor;
}
