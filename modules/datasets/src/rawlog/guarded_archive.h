#pragma once

#include <mrpt/io/CFileGZInputStream.h>
#include <mrpt/serialization/CArchive.h>

#include <cstdint>
#include <string>

namespace etalon {

/**
 * The bytes of a rawlog on their way to MRPT, which makes room for whatever length a log states (up
 * to 4 GB) and takes any byte for a bool.
 *
 * The format says nowhere how long an object is; only the class that reads it knows. So this
 * watches what the classes ask for: the name of a class stands before its fields, and a number of
 * four bytes is a length or a size in all classes that Etalon uses. One that the whole log could
 * not hold is refused before MRPT sees it; so are images of such a size, and a frame within a
 * frame, which MRPT would follow to any depth. In other observations, which Etalon passes over,
 * four bytes may be anything: they are read as they are, but for images, whose sizes and JPEGs are
 * checked wherever they stand.
 */
class GuardedArchive : public mrpt::serialization::CArchive {
 public:
  /** @throws DataError if `path` is no file that can be read */
  explicit GuardedArchive(const std::string& path);

  void startObject();
  /** Read since startObject(): what tells the end of the log from the end inside an object. */
  std::uint64_t bytesOfObject() const { return bytes_of_object_; }
  /** Why read() threw, in words; empty if it did not. MRPT puts its own words for it. */
  const std::string& refusal() const { return refusal_; }

 private:
  /** What the next bytes are. */
  enum class Next : std::uint8_t {
    kVersion,
    kExternal,
    kColor,
    kWidth,
    kHeight,
    kJpegLength,
    kJpeg,
    kOther
  };

  size_t write(const void* buffer, size_t count) override;
  /** All `count` bytes or none. */
  size_t read(void* buffer, size_t count) override;
  std::string getArchiveDescription() const override;

  void watch(const std::uint8_t* bytes, size_t count);
  void startClass(const std::string& name, bool is_first);
  void checkVersion(std::uint8_t version);
  void checkArea();
  [[noreturn]] void refuse(const std::string& reason);

  mrpt::io::CFileGZInputStream stream_;
  std::int64_t most_bytes_ = 0;  ///< that the log can hold
  std::uint64_t bytes_of_object_ = 0;
  std::string refusal_;

  std::string class_;  ///< that was named last, without its namespace
  Next next_ = Next::kOther;
  size_t name_length_ = 0;  ///< if a name may follow
  bool is_known_ = false;   ///< four bytes are a length
  bool in_frame_ = false;   ///< of observations
  bool is_text_ = false;    ///< the next four bytes are the text that the four before announced
  bool has_color_ = false;  ///< the image
  /** Of an image or a matrix; of an image with colour negative if it is raw. */
  std::int64_t width_ = 0, height_ = 0;
};

}  // namespace etalon
