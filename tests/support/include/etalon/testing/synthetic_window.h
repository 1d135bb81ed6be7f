#pragma once

// Lives in the contract suite, which is installed; tests of modules include it from here.
#include "etalon/contract/synthetic_window.h"  // IWYU pragma: export
