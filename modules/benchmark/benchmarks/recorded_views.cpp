#include "recorded_views.h"

#include <algorithm>
#include <ctime>
#include <utility>

namespace etalon {

double cpuMilliseconds() {
  timespec now{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return 1e3 * static_cast<double>(now.tv_sec) + 1e-6 * static_cast<double>(now.tv_nsec);
}

RecordedViews::RecordedViews(const std::string& source)
    : recording_(openRecording(source)), views_(recording_->calibration()) {}

double RecordedViews::takeReadingMilliseconds() { return std::exchange(reading_ms_, 0.0); }

bool RecordedViews::keep(TimeNs view) {
  show();
  return views_.keep(view);
}

std::vector<ViewMatch> RecordedViews::find(TimeNs view, const std::vector<ViewQuery>& queries) {
  show();
  return views_.find(view, queries);
}

void RecordedViews::show() {
  if (shown_ == now_) return;
  shown_ = now_;
  const double before = cpuMilliseconds();
  const std::vector<TimeNs>& stamps = recording_->imageStamps();
  const auto index = std::lower_bound(stamps.begin(), stamps.end(), now_) - stamps.begin();
  const LoadedFrame loaded = recording_->loadFrame(index);
  views_.show(loaded.frame.left, loaded.frame.right);
  reading_ms_ += cpuMilliseconds() - before;
}

}  // namespace etalon
