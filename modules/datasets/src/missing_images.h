#pragma once

#include <string>

namespace etalon {

/** What to do where image files are missing that a recording of this kind refers to: the end of a
 * sentence, empty where there is nothing to say. */
inline std::string adviceOnMissingImages(const std::string& kind) {
  if (kind != "rawlog") return "";
  return "; the log refers to its images by their paths: convert the recording again where they "
         "are "
         "now, or with --embed";
}

}  // namespace etalon
