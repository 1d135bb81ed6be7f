#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <mrpt/io/CFileGZOutputStream.h>

#include "etalon/core/errors.h"
#include "rawlog/rawlog_test.h"

namespace etalon::testing {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

/** A log of which some bytes are others. */
class DamagedRawlog : public Rawlog {
 protected:
  DamagedRawlog() {
    convert(log, true);
    whole = readText(log);
  }

  /** What is said about the log when the bytes so far behind the first `name` are `bytes`. */
  std::string errorWith(const std::string& name, int offset, const std::string& bytes) const {
    std::string text = whole;
    const size_t at = text.find(name);
    if (at == std::string::npos) return "no '" + name + "' in the log";
    text.replace(at + name.size() + offset, bytes.size(), bytes);
    return errorOf(text);
  }
  std::string errorOf(const std::string& text) const {
    writeText(log, text);
    return dataErrorOf([&] { openSource(log); });
  }

  std::string whole;
  const std::string huge{"\xff\xff\xff\x7f", 4};  // 2^31 - 1
  const std::string many{"\x00\x10\x00\x00", 4};  // 4096
};

/** An object of MRPT's format as far as its fields. */
std::string header(const std::string& name, int version) {
  return static_cast<char>(0x80 | name.size()) + name + static_cast<char>(version);
}

TEST_F(DamagedRawlog, LengthsThatItCannotHoldAreRefusedBeforeThereIsRoomForThem) {
  for (const std::string& length : {huge, std::string(4, '\xff')}) {
    EXPECT_THAT(errorWith("mrpt::obs::CObservationComment", 1, length),
                AllOf(HasSubstr(log), HasSubstr("object 1"), HasSubstr("more than the log")));
    EXPECT_THAT(errorWith("mrpt::obs::CObservationIMU", 407, length),
                HasSubstr("more than the log can hold"));
  }
  EXPECT_THAT(errorOf(header("mrpt::obs::CSensoryFrame", 2) + huge + whole),
              HasSubstr("more than the log can hold"));
}

TEST_F(DamagedRawlog, SizesOfImagesThatItCannotHoldAreRefused) {
  const std::string image = "mrpt::img::CImage";
  EXPECT_THAT(errorWith(image, 3, huge), HasSubstr("2147483647 x 48"));
  EXPECT_THAT(errorWith(image, 3, many + many), HasSubstr("4096 x 4096"));
  EXPECT_THAT(errorWith(image, 3, std::string(4, '\xff')), HasSubstr("-1 x 48"));
  // Raw, with colour: 64 x 48 pixels of three bytes are behind the sizes in neither case.
  EXPECT_THAT(errorWith(image, 2, "\x01" + std::string(3, '\x80') + "\xff" + many),
              HasSubstr("more than the log can hold"));
}

TEST_F(DamagedRawlog, BytesThatAreNoBoolAreRefused) {
  EXPECT_THAT(errorWith("mrpt::obs::CObservationIMU", 120, "\x02"),
              AllOf(HasSubstr(log), HasSubstr("flags of 0 or 1")));
  EXPECT_THAT(errorWith("mrpt::img::CImage", 1, "\x02"), HasSubstr("expected 0 or 1, found 2"));
  // Behind the left image of 64 x 48: whether there are a disparity and a right one.
  const int flags = 1 + 1 + 1 + 5 * 4 + 1 + 64 * 48 + 1;
  EXPECT_THAT(errorWith("mrpt::img::CImage", flags, std::string("\x00\x03", 2)),
              HasSubstr("flags of 0 or 1"));
}

TEST_F(DamagedRawlog, OnlyWhatALogHoldsIsGivenToMrpt) {
  const std::string frame = header("mrpt::obs::CSensoryFrame", 2) + std::string("\1\0\0\0", 4);
  EXPECT_THAT(errorOf(frame + frame + frame + whole), HasSubstr("a sensory frame inside another"));
  EXPECT_THAT(errorOf(header("mrpt::poses::CPose3D", 3) + whole),
              HasSubstr("CPose3D; expected an observation"));
  EXPECT_THAT(errorOf(header("nullptr", 0x88) + whole), HasSubstr("expected an observation"));
  EXPECT_THAT(errorWith("mrpt::img::CImage", 0, "\x02"), HasSubstr("an image of version 2"));
}

TEST_F(DamagedRawlog, ACompressedOneHoldsMoreThanItsSize) {
  {
    mrpt::io::CFileGZOutputStream out(log);
    out.Write(whole.data(), whole.size());
  }
  ASSERT_LT(fs::file_size(log), whole.size());
  expectSameRecording(*openWhole(euroc.string()), *openWhole(log));
}

}  // namespace
}  // namespace etalon::testing
