#include "etalon/initialization/initializer.h"

extern "C" const etalon::InitializerDescriptor* etalon_initializer_descriptor() { return nullptr; }
