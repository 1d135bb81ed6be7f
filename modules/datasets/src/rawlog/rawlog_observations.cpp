#include "rawlog/rawlog_observations.h"

#include <mrpt/io/CFileGZInputStream.h>
#include <mrpt/serialization/CArchive.h>

#include <algorithm>
#include <filesystem>

#include "etalon/core/errors.h"

namespace etalon {

/** MRPT's exceptions carry a banner and a stack trace around their message, and in it bytes of the
 * file as they are. */
static std::string messageOf(const std::exception& e) {
  std::string text = e.what();
  const std::string key = "Message:";
  const size_t at = text.find(key);
  if (at != std::string::npos) text.erase(0, text.find_first_not_of(' ', at + key.size()));
  constexpr size_t kLongest = 160;
  text = text.substr(0, std::min(text.find('\n'), kLongest));
  std::replace_if(
      text.begin(), text.end(), [](char c) { return c < ' ' || c > '~'; }, '?');
  return text;
}

/** Counts the bytes of the current object, which tells the end of the log from the end inside an
 * object. */
struct RawlogObservations::Archive : public mrpt::serialization::CArchive {
  mrpt::io::CFileGZInputStream stream;
  size_t bytes_of_object = 0;

  size_t write(const void*, size_t) override { throw std::logic_error("opened for reading"); }
  size_t read(void* buffer, size_t count) override {
    const size_t got = stream.Read(buffer, count);
    if (got > count) return 0;  // zlib's error code
    bytes_of_object += got;
    return got;
  }
  std::string getArchiveDescription() const override { return stream.getStreamDescription(); }
};

RawlogObservations::RawlogObservations(const std::string& path)
    : path_(path), archive_(std::make_unique<Archive>()) {
  std::error_code error;
  if (!std::filesystem::is_regular_file(path, error))
    throw DataError(path, 0, "there is no such file; expected an MRPT rawlog");
  if (!archive_->stream.open(path))
    throw DataError(path, 0, "cannot be opened; expected an MRPT rawlog");
}

RawlogObservations::~RawlogObservations() = default;

mrpt::obs::CObservation::Ptr RawlogObservations::next() {
  for (;;) {
    if (frame_) {
      if (in_frame_ < frame_->size()) return frame_->getObservationByIndex(in_frame_++);
      frame_.reset();
    }
    archive_->bytes_of_object = 0;
    ++objects_;
    mrpt::serialization::CSerializable::Ptr object;
    try {
      object = archive_->ReadObject();
    } catch (const std::exception& e) {
      if (archive_->bytes_of_object == 0) {
        --objects_;
        return nullptr;
      }
      throw DataError(
          path_, 0,
          where() + " cannot be read after " + std::to_string(archive_->bytes_of_object) +
              " bytes; expected an MRPT rawlog, is it truncated? (" + messageOf(e) + ")");
    }
    if (auto observation = std::dynamic_pointer_cast<mrpt::obs::CObservation>(object))
      return observation;
    frame_ = std::dynamic_pointer_cast<mrpt::obs::CSensoryFrame>(object);
    in_frame_ = 0;
  }
}

}  // namespace etalon
