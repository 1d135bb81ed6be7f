#include "etalon/core/printable.h"

#include <gtest/gtest.h>

namespace etalon {
namespace {

TEST(Printable, ShowsWhatWouldActUnseen) {
  EXPECT_EQ(printable("\x1b[31mred\x1b[0m"), "\\x1b[31mred\\x1b[0m");
  EXPECT_EQ(printable("bell\a, delete\x7f, zero" + std::string(1, '\0')),
            "bell\\x07, delete\\x7f, zero\\x00");
  EXPECT_EQ(printable("\xEF\xBB\xBFkey"), "\\ufeffkey");  // byte order mark
  EXPECT_EQ(printable("a\xE2\x80\xAE"
                      "b"),
            "a\\u202eb");  // writes to the left
  EXPECT_EQ(printable("a\xC2\x9B"
                      "31m"),
            "a\\u009b31m");  // C1 form of ESC [
  EXPECT_EQ(printable("two\nlines\tand\r"), "two\\nlines\\tand\\x0d");
  EXPECT_EQ(printable("two\nlines\tand\r", true), "two\nlines\tand\\x0d");
}

TEST(Printable, LeavesTextAlone) {
  for (const char* text : {"", "plain 1.5 m/s^2", "M\xC3\xBCnchen \xE2\x82\xAC \xF0\x9F\x98\x80",
                           "latin-1 \xFC", "cut \xE2\x82", "cut \xC2"})
    EXPECT_EQ(printable(text), text);
}

TEST(Printable, TakesAByteOrderMarkOffTheBeginningAlone) {
  EXPECT_EQ(withoutByteOrderMark("\xEF\xBB\xBFkey\xEF\xBB\xBF"), "key\xEF\xBB\xBF");
  EXPECT_EQ(withoutByteOrderMark("key"), "key");
  EXPECT_EQ(withoutByteOrderMark("\xEF\xBB"), "\xEF\xBB");
}

}  // namespace
}  // namespace etalon
