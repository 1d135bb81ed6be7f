#include "etalon/datasets/rawlog_writer.h"

#include <mrpt/serialization/CArchive.h>
#include <mrpt/serialization/archiveFrom_std_streams.h>

#include <cerrno>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <vector>

#include "etalon/core/errors.h"

namespace etalon {

struct RawlogWriter::Impl {
  std::ofstream out;
  mrpt::serialization::CArchiveStreamBase<std::ostream> archive{out};
};

RawlogWriter::RawlogWriter(const std::string& path)
    : path_(path), temporary_path_(path + ".part"), impl_(std::make_unique<Impl>()) {
  impl_->out.open(temporary_path_, std::ios::binary | std::ios::trunc);
  if (!impl_->out)
    throw DataError(temporary_path_, 0, std::string("cannot be created: ") + std::strerror(errno));
}

RawlogWriter::~RawlogWriter() {
  if (!impl_) return;
  impl_.reset();
  std::error_code ignored;
  std::filesystem::remove(temporary_path_, ignored);
}

void RawlogWriter::write(const mrpt::serialization::CSerializable& object) {
  if (!impl_) throw DataError(path_, 0, "the log is closed already");
  try {
    impl_->archive << object;
  } catch (const std::exception&) {
    impl_->out.setstate(std::ios::failbit);
  }
  if (!impl_->out) throw DataError(temporary_path_, 0, "cannot be written (disk full?)");
}

void RawlogWriter::close() {
  if (!impl_) return;
  impl_->out.close();
  const bool failed = !impl_->out;
  std::error_code error;
  if (!failed) {
    std::filesystem::rename(temporary_path_, path_, error);
    if (!error) {
      impl_.reset();
      return;
    }
  }
  throw DataError(
      path_, 0,
      failed ? "cannot be written (disk full?)" : "cannot be given its name: " + error.message());
}

}  // namespace etalon
