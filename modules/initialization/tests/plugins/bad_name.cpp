// A name that no INI section may have.
#include "test_initializer.h"

ETALON_TEST_INITIALIZER(BadName)
ETALON_REGISTER_INITIALIZER(BadName, etalon::test_plugins, "Bad Name", "1.0", "ill-named")
