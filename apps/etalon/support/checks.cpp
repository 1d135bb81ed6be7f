#include "support/checks.h"

#include <charconv>
#include <cmath>
#include <cstdint>
#include <string>

namespace etalon::app {

namespace {

template <typename T>
bool parsesWhole(const std::string& text, T* value) {
  const char* const end = text.data() + text.size();
  const auto result = std::from_chars(text.data(), end, *value);
  return result.ec == std::errc() && result.ptr == end;
}

CLI::Validator checkNumberOf(const std::string& unit, bool not_negative) {
  return {[unit, not_negative](const std::string& text) {
            double value = 0.0;
            const bool ok = parsesWhole(text, &value) && std::isfinite(value) &&
                            (!not_negative || value >= 0.0);
            return ok ? std::string()
                      : "expected a number of " + unit +
                            std::string(not_negative ? ", at least 0" : "") + ", found '" + text +
                            "'";
          },
          ""};
}

}  // namespace

CLI::Validator checkSeconds(bool not_negative) { return checkNumberOf("seconds", not_negative); }

CLI::Validator checkMilliseconds() { return checkNumberOf("milliseconds", true); }

CLI::Validator checkShare() {
  return {[](const std::string& text) {
            double value = 0.0;
            return parsesWhole(text, &value) && value >= 0.0 && value <= 1.0
                       ? std::string()
                       : "expected a share from 0 to 1, found '" + text + "'";
          },
          ""};
}

CLI::Validator checkOutputPath() {
  return {[](const std::string& text) {
            return text.empty() || text[0] == '-'
                       ? "expected a path, found '" + text +
                             "'; a path that begins with '-' is written ./" + text
                       : std::string();
          },
          ""};
}

void addTimeLimitOption(CLI::App* command, const std::string& what, double* limit_s) {
  command
      ->add_option("--time-limit", *limit_s,
                   what + ", s; after that, or after waiting that long, it is ended")
      ->check(CLI::Range(0.01, 1e6, "seconds from 0.01 to 1e6"))
      ->capture_default_str();
}

CLI::Validator checkWholeNumber() {
  return {[](const std::string& text) {
            std::uint64_t value = 0;
            return parsesWhole(text, &value)
                       ? std::string()
                       : "expected a whole number from 0 to 2^64 - 1, found '" + text + "'";
          },
          ""};
}

}  // namespace etalon::app
