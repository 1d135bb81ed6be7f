#pragma once

#include <mrpt/serialization/CSerializable.h>

#include <memory>
#include <string>

namespace etalon {

/**
 * Writes an MRPT rawlog object by object under a temporary name; close() gives it its final name,
 * so that an interrupted run leaves no half a log. Uncompressed: every reader of MRPT takes it, and
 * it is the fastest to write and to read.
 */
class RawlogWriter {
 public:
  /** @throws DataError if the file cannot be created. */
  explicit RawlogWriter(const std::string& path);
  /** Removes the temporary file unless the log was closed. */
  ~RawlogWriter();
  RawlogWriter(const RawlogWriter&) = delete;
  RawlogWriter& operator=(const RawlogWriter&) = delete;

  /** @throws DataError if it cannot be written (disk full). */
  void write(const mrpt::serialization::CSerializable& object);
  /** Completes the log. @throws DataError if it cannot be written or renamed. */
  void close();

  const std::string& path() const { return path_; }

 private:
  struct Impl;
  std::string path_;
  std::unique_ptr<Impl> impl_;
};

}  // namespace etalon
