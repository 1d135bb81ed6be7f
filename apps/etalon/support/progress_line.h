#pragma once

#include <chrono>
#include <functional>
#include <string>

namespace etalon::app {

/** The live line of long work on stderr: rewritten in place on a terminal, a line every few seconds
 * elsewhere. */
class ProgressLine {
 public:
  ProgressLine();

  /**
   * Shows a text if it is time for one.
   * @param make_text called only if it is shown
   * @param last whether it is the last of its kind: shown in any case, and left standing
   */
  void update(bool last, const std::function<std::string()>& make_text);
  /** Before anything else is printed: removes what stands there. */
  void interrupt();

 private:
  bool due() const;

  bool terminal_;
  size_t length_ = 0;  ///< of the text that stands there
  std::chrono::steady_clock::time_point printed_;
};

/** "1:05" or "1:02:03". */
std::string clockTime(double seconds);

}  // namespace etalon::app
