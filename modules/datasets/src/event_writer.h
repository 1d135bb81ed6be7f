#pragma once

#include "etalon/datasets/convert.h"

namespace etalon {

/** Takes what a source delivers, to write it down. */
class EventWriter {
 public:
  EventWriter() = default;
  virtual ~EventWriter() = default;
  EventWriter(const EventWriter&) = delete;
  EventWriter& operator=(const EventWriter&) = delete;

  virtual void write(const ImuSample& sample) = 0;
  /** Both images are there. */
  virtual void write(const StereoFrame& frame) = 0;
};

/** Gives all that the source still delivers to the writer. The report's lost_truth is what poses alone
 * leave out. @throws ConfigError if the source does
 * not decode its images */
ConvertReport writeEvents(SensorSource& source, const ConvertOptions& options, EventWriter* writer);

}  // namespace etalon
