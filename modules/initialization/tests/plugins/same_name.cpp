// Another class under the name of good.cpp.
#include "test_initializer.h"

ETALON_TEST_INITIALIZER(SameName)
ETALON_REGISTER_INITIALIZER(SameName, etalon::test_plugins, "good", "9.9", "an impostor")
