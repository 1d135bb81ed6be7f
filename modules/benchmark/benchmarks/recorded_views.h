#pragma once

// The images of a recording as old views, for programs that run the odometry from cached tracks.

#include <memory>
#include <string>
#include <vector>

#include "etalon/datasets/recorded_source.h"
#include "etalon/map/image_views.h"

namespace etalon {

/** Reads an image only when it is needed. */
class RecordedViews : public ViewMatcher {
 public:
  explicit RecordedViews(const std::string& source);

  /** Sets the stamp of the frame that is processed next; stamps must not decrease. */
  void at(TimeNs t) { now_ = t; }
  /** CPU time of reading images since the last call, ms; it is no part of the odometry's. */
  double takeReadingMilliseconds();

  bool keep(TimeNs view) override;
  void dropAllBut(const std::vector<TimeNs>& views) override { views_.dropAllBut(views); }
  std::vector<ViewMatch> find(TimeNs view, const std::vector<ViewQuery>& queries) override;

 private:
  void show();

  std::unique_ptr<RecordedSource> recording_;
  ImageViews views_;
  TimeNs now_ = 0, shown_ = -1;
  double reading_ms_ = 0.0;
};

/** CPU time of this thread, ms. */
double cpuMilliseconds();

}  // namespace etalon
