#pragma once

#include <chrono>
#include <functional>
#include <string>

namespace etalon::app {

/** The progress line of long work on stderr: rewritten in place on a terminal, printed every few
 * seconds elsewhere. */
class ProgressLine {
 public:
  ProgressLine();

  /**
   * Shows a text if the last one is old enough.
   * @param make_text called only if the text is shown
   * @param last whether this is the final text, which is always shown and stays on the screen
   */
  void update(bool last, const std::function<std::string()>& make_text);
  /** Removes the line. To be called before anything else is printed. */
  void interrupt();

 private:
  bool due() const;

  bool terminal_;
  size_t length_ = 0;  ///< of the text on the screen
  std::chrono::steady_clock::time_point printed_;
};

/** "1:05" or "1:02:03". */
std::string clockTime(double seconds);

}  // namespace etalon::app
