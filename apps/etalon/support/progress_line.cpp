#include "support/progress_line.h"

#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "etalon/core/text.h"

namespace etalon::app {

ProgressLine::ProgressLine()
    : terminal_(isatty(STDERR_FILENO) == 1), printed_(std::chrono::steady_clock::now()) {}

bool ProgressLine::due() const {
  const std::chrono::duration<double> since = std::chrono::steady_clock::now() - printed_;
  return since.count() > (terminal_ ? 0.2 : 5.0);
}

void ProgressLine::update(bool last, const std::function<std::string()>& make_text) {
  if (!last && !due()) return;
  printed_ = std::chrono::steady_clock::now();
  const std::string text = make_text();
  if (!terminal_) {
    std::fprintf(stderr, "%s\n", text.c_str());
    return;
  }
  const size_t blanks = length_ > text.size() ? length_ - text.size() : 0;
  std::fprintf(stderr, "\r%s%*s%s", text.c_str(), static_cast<int>(blanks), "", last ? "\n" : "");
  std::fflush(stderr);
  length_ = last ? 0 : text.size();
}

void ProgressLine::interrupt() {
  if (terminal_ && length_ > 0) std::fprintf(stderr, "\r%*s\r", static_cast<int>(length_), "");
  length_ = 0;
}

std::string clockTime(double seconds) {
  const auto whole = static_cast<long long>(std::lround(std::max(0.0, seconds)));
  if (whole < 3600) return format("%lld:%02lld", whole / 60, whole % 60);
  return format("%lld:%02lld:%02lld", whole / 3600, whole / 60 % 60, whole % 60);
}

}  // namespace etalon::app
