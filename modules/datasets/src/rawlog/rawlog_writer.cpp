#include "etalon/datasets/rawlog_writer.h"

#include <mrpt/serialization/CArchive.h>
#include <mrpt/serialization/archiveFrom_std_streams.h>

#include <cerrno>

#include "etalon/core/errors.h"
#include "etalon/core/output_file.h"

namespace etalon {

struct RawlogWriter::Impl {
  explicit Impl(const std::string& path) : file(path) {}

  OutputFile file;
  mrpt::serialization::CArchiveStreamBase<std::ostream> archive{file.stream()};
};

RawlogWriter::RawlogWriter(const std::string& path)
    : path_(path), impl_(std::make_unique<Impl>(path)) {}

RawlogWriter::~RawlogWriter() = default;

void RawlogWriter::write(const mrpt::serialization::CSerializable& object) {
  if (!impl_) throw DataError(path_, 0, "the log is closed already");
  errno = 0;
  try {
    impl_->archive << object;
  } catch (const std::exception&) {
    impl_->file.stream().setstate(std::ios::failbit);
  }
  if (!impl_->file.stream()) impl_->file.fail();
}

void RawlogWriter::close() {
  if (!impl_) return;
  impl_->file.putInPlace();
  impl_.reset();
}

}  // namespace etalon
