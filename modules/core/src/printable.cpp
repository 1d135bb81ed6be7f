#include "etalon/core/printable.h"

#include "etalon/core/text.h"

namespace etalon {

namespace {

constexpr char kByteOrderMark[] = "\xEF\xBB\xBF";

/** The code point of the two or three bytes of UTF-8 at `i`; 0 where there are none. */
unsigned codePoint(const std::string& text, size_t i, size_t* length) {
  const auto byte = [&text](size_t k) -> unsigned {
    return k < text.size() ? static_cast<unsigned char>(text[k]) : 0u;
  };
  const auto follows = [&byte](size_t k) { return (byte(k) & 0xC0u) == 0x80u; };
  if ((byte(i) & 0xE0u) == 0xC0u && follows(i + 1)) {
    *length = 2;
    return (byte(i) & 0x1Fu) << 6 | (byte(i + 1) & 0x3Fu);
  }
  if ((byte(i) & 0xF0u) == 0xE0u && follows(i + 1) && follows(i + 2)) {
    *length = 3;
    return (byte(i) & 0x0Fu) << 12 | (byte(i + 1) & 0x3Fu) << 6 | (byte(i + 2) & 0x3Fu);
  }
  return 0;
}

/** C1 controls, zero-width marks, line separators and overrides of the writing direction. */
bool actsUnseen(unsigned code) {
  return (code >= 0x80 && code <= 0x9F) || (code >= 0x200B && code <= 0x200F) ||
         (code >= 0x2028 && code <= 0x202E) || (code >= 0x2060 && code <= 0x206F) || code == 0xFEFF;
}

}  // namespace

std::string printable(const std::string& text, bool lines) {
  std::string shown;
  for (size_t i = 0; i < text.size(); ++i) {
    const auto c = static_cast<unsigned char>(text[i]);
    size_t length = 0;
    if (c == '\n') {
      shown += lines ? "\n" : "\\n";
    } else if (c == '\t') {
      shown += lines ? "\t" : "\\t";
    } else if (c < 0x20 || c == 0x7F) {
      shown += format("\\x%02x", c);
    } else if (const unsigned code = codePoint(text, i, &length); code != 0 && actsUnseen(code)) {
      shown += format("\\u%04x", code);
      i += length - 1;
    } else {
      shown += text[i];
    }
  }
  return shown;
}

std::string withoutByteOrderMark(const std::string& text) {
  return text.rfind(kByteOrderMark, 0) == 0 ? text.substr(sizeof kByteOrderMark - 1) : text;
}

}  // namespace etalon
