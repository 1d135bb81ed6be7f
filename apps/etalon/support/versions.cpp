#include "support/versions.h"

#include <ceres/version.h>
#include <mrpt/version.h>

#include <opencv2/core/version.hpp>

namespace etalon::app {

std::map<std::string, std::string> versions() {
  // 0x258 is 2.5.8.
  const std::string mrpt = std::to_string(MRPT_VERSION >> 8) + "." +
                           std::to_string(MRPT_VERSION >> 4 & 15) + "." +
                           std::to_string(MRPT_VERSION & 15);
  return {{"etalon", ETALON_VERSION},
          {"opencv", CV_VERSION},
          {"ceres", CERES_VERSION_STRING},
          {"mrpt", mrpt}};
}

}  // namespace etalon::app
