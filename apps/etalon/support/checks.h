#pragma once

#include <CLI/CLI.hpp>

namespace etalon::app {

// CLI11's own checks let invalid values through or print the 300 digits of the largest double.

/** Accepts any finite number of seconds, at least 0 if `not_negative`. */
CLI::Validator checkSeconds(bool not_negative);

/** Accepts any finite number of milliseconds, at least 0. */
CLI::Validator checkMilliseconds();

/** Accepts a share from 0 to 1. */
CLI::Validator checkShare();

/** Accepts a path that does not look like an option: `--out --help` does not ask for a folder. */
CLI::Validator checkOutputPath();

/** Declares --time-limit, the processor time that one call of an initializer may use.
 * @param what as the beginning of a sentence: "Processor time that an initializer may use" */
void addTimeLimitOption(CLI::App* command, const std::string& what, double* limit_s);

/** Accepts an integer from 0 to 2^64 - 1. */
CLI::Validator checkWholeNumber();

}  // namespace etalon::app
