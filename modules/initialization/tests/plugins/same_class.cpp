// Another name for a class that is called as that of good.cpp.
#include "test_initializer.h"

ETALON_TEST_INITIALIZER(Good)
ETALON_REGISTER_INITIALIZER(Good, etalon::test_plugins, "same_class", "1.0", "a namesake")
