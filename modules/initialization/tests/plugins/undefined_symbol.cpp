// Linked without -z,defs, as by hand.
#include "test_initializer.h"

namespace etalon::test_plugins {
double functionThatNobodyDefines(int x);
double callIt() { return functionThatNobodyDefines(1); }
}  // namespace etalon::test_plugins

ETALON_TEST_INITIALIZER(UndefinedSymbol)
ETALON_REGISTER_INITIALIZER(UndefinedSymbol, etalon::test_plugins, "undefined_symbol", "1.0", "x")
