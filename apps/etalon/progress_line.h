#pragma once

#include <chrono>
#include <string>

namespace etalon::app {

/** The live line of long work on stderr: rewritten in place on a terminal, a line every few seconds
 * elsewhere. */
class ProgressLine {
 public:
  ProgressLine();

  /** Whether a call of print() would show something; so that the text is made only then. */
  bool due() const;
  /** @param last whether it is the last of its kind: printed in any case, and left standing */
  void print(const std::string& text, bool last);
  /** Before anything else is printed: removes what stands there. */
  void interrupt();

 private:
  bool terminal_;
  size_t length_ = 0;  ///< of the text that stands there
  std::chrono::steady_clock::time_point printed_;
};

/** "1:05" or "1:02:03". */
std::string clockTime(double seconds);

}  // namespace etalon::app
