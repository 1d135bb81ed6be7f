// Needs a symbol of an interface that this library no longer has.
#include "etalon/initialization/initializer.h"

namespace etalon::abi_v0 {
int interfaceOfAnotherVersion();
}

extern "C" const etalon::InitializerDescriptor* etalon_initializer_descriptor() {
  static const etalon::InitializerDescriptor kDescriptor{
      etalon::abi_v0::interfaceOfAnotherVersion(), "", "", "", ""};
  return &kDescriptor;
}
