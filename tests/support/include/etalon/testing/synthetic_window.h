#pragma once

// The window is simulation's, its problem the contract suite's; tests include both from here.
#include "etalon/contract/synthetic_window.h"  // IWYU pragma: export
