#pragma once

#include <mrpt/obs/CObservation.h>
#include <mrpt/obs/CSensoryFrame.h>

#include <memory>
#include <string>

namespace etalon {

class GuardedArchive;

/** The observations of a rawlog in file order; those of sensory frames one by one. */
class RawlogObservations {
 public:
  /** @throws DataError if there is no such file. */
  explicit RawlogObservations(const std::string& path);
  ~RawlogObservations();

  /**
   * The next observation; null at the end of the log. Actions are passed over.
   * @throws DataError naming the object if the log ends inside it, if it cannot be read, or if it is
   * damaged (see GuardedArchive)
   */
  mrpt::obs::CObservation::Ptr next();

  /** "object 12", the one that next() read last, counted from 1. */
  std::string where() const { return "object " + std::to_string(objects_); }

 private:
  /** Null at the end of the log. */
  mrpt::serialization::CSerializable::Ptr nextObject();

  std::string path_;
  std::unique_ptr<GuardedArchive> archive_;
  mrpt::obs::CSensoryFrame::Ptr frame_;  ///< being taken apart
  size_t in_frame_ = 0;
  size_t objects_ = 0;
};

}  // namespace etalon
