#include "test_initializer.h"

ETALON_TEST_INITIALIZER(Good)
ETALON_REGISTER_INITIALIZER(Good, etalon::test_plugins, "good", "1.2", "does as it is told")
