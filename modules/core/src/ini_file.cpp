#include "etalon/core/ini_file.h"

#include "etalon/core/errors.h"

namespace etalon {}
