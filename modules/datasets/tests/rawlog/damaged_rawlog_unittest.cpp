#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <mrpt/img/CImage.h>
#include <mrpt/io/CFileGZOutputStream.h>
#include <mrpt/io/CMemoryStream.h>
#include <mrpt/obs/CObservationStereoImages.h>
#include <mrpt/serialization/CArchive.h>

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

TEST_F(DamagedRawlog, ANameEndsAtItsZeroAsInMrpt) {
  const std::string name = "mrpt::obs::CObservationComment";
  EXPECT_THAT(errorOf(header(name + std::string("\0ab", 3), 0) + huge + whole),
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
  // The product of the greatest sizes and three channels is beyond 64 bits.
  const std::string least = std::string("\x01\x00\x00\x80", 4);  // -(2^31 - 1)
  EXPECT_THAT(errorWith(image, 2, "\x01" + least + least),
              HasSubstr("-2147483647 x -2147483647, more than the log can hold"));
}

/** An observation of two images with colour of 64 x 48 pixels, which MRPT writes as JPEG if it is told to. */
std::string stereoInColor() {
  mrpt::obs::CObservationStereoImages stereo;
  stereo.imageLeft = mrpt::img::CImage(64, 48, mrpt::img::CH_RGB);
  stereo.imageLeft.filledRectangle(0, 0, 63, 47, mrpt::img::TColor(80, 120, 160));
  stereo.imageRight = stereo.imageLeft;
  stereo.hasImageRight = true;
  mrpt::io::CMemoryStream bytes;
  const bool is_raw = mrpt::img::CImage::DISABLE_JPEG_COMPRESSION();
  mrpt::img::CImage::DISABLE_JPEG_COMPRESSION(false);
  mrpt::serialization::archiveFrom(bytes) << stereo;
  mrpt::img::CImage::DISABLE_JPEG_COMPRESSION(is_raw);
  return {static_cast<const char*>(bytes.getRawBufferData()),
          static_cast<size_t>(bytes.getTotalBytesCount())};
}

TEST_F(DamagedRawlog, AnImageWithColorIsReadOnlyIfItsJpegIsWhatTheLogSays) {
  const std::string color = stereoInColor();
  const std::string frame_header("\xff\xc0\x00\x11\x08\x00\x30\x00\x40", 9);  // 48 rows, 64 columns
  const size_t start = color.find("\xff\xd8"), size = color.find(frame_header);
  ASSERT_NE(start, std::string::npos);
  ASSERT_NE(size, std::string::npos);
  EXPECT_THAT(errorOf(color), HasSubstr("found none"));  // IMU samples
  const auto with = [&color](size_t at, const std::string& bytes) {
    return std::string(color).replace(at, bytes.size(), bytes);
  };
  EXPECT_THAT(errorOf(with(size + 5, "\xf0\x01\xf0\x01")), HasSubstr("a JPEG of 61441 x 61441"));
  EXPECT_THAT(errorOf(with(start, "\xff\xd7")), HasSubstr("JPEG of 64 x 48 pixels that cannot"));
  EXPECT_THAT(errorOf(with(start + 2, "\xfe")), HasSubstr("a JPEG without a header"));
  const size_t end = color.find("\xff\xd9", size);
  EXPECT_THAT(errorOf(with(end - 6, "\xff\x3f")), HasSubstr("does not end as it should"));
  EXPECT_THAT(errorOf(with(end, "\xff\xd8")), HasSubstr("does not end as it should"));
  EXPECT_THAT(errorOf(with(size + 9, "\x01")), HasSubstr("1 channels; expected 3"));
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
