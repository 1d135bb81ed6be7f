#include "support/guarded.h"

#include <cstdio>
#include <cstdlib>
#include <exception>
#include <iostream>
#include <new>
#include <opencv2/core.hpp>
#include <string>

#include "commands.h"
#include "etalon/core/errors.h"
#include "etalon/core/printable.h"

namespace etalon::app {

namespace {

constexpr char kWantOfMemory[] = "etalon: the memory does not suffice\n";

int say(const std::string& sentence, int exit_code) {
  std::fflush(stdout);
  std::fprintf(stderr, "etalon: %s\n", printable(sentence, true).c_str());
  return exit_code;
}

int sayNoMemory() {
  std::fputs(kWantOfMemory, stderr);
  return kDataErrorExit;
}

}  // namespace

void sayWantOfMemory() {
  static const std::terminate_handler kBefore = std::get_terminate();
  std::set_terminate([] {
    try {
      if (const std::exception_ptr exception = std::current_exception())
        std::rethrow_exception(exception);
    } catch (const std::bad_alloc&) {
      std::fputs(kWantOfMemory, stderr);
      std::_Exit(kDataErrorExit);
    } catch (...) {
    }
    kBefore();
  });
}

int withOutputWritten(int exit_code) {
  return guarded([exit_code] {
    std::cout.flush();
    if (std::fflush(stdout) != 0 || std::ferror(stdout) != 0 || !std::cout)
      throw DataError("", 0, "standard output could not be written; is the disk full?");
    return exit_code;
  });
}

int guarded(const std::function<int()>& command) {
  try {
    return command();
  } catch (const DataError& e) {
    return say(e.what(), kDataErrorExit);
  } catch (const Error& e) {
    return say(e.what(), kUsageError);
  } catch (const std::bad_alloc&) {
    return sayNoMemory();
  } catch (const cv::Exception& e) {
    if (e.code == cv::Error::StsNoMem) return sayNoMemory();
    return say(std::string("unexpected error: ") + e.what(), kDataErrorExit);
  } catch (const std::exception& e) {
    return say(std::string("unexpected error: ") + e.what(), kDataErrorExit);
  }
}

}  // namespace etalon::app
