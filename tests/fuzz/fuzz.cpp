// All fuzzers in one program: etalon_fuzz --target=NAME, and libFuzzer's options, which begin with one dash.

#include <cstdio>
#include <cstdlib>
#include <string>

#include "fuzz_targets.h"

namespace {

struct Target {
  const char* name;
  void (*run)(const std::uint8_t* data, std::size_t size);
};
constexpr Target kTargets[] = {
    {"bag", etalon::fuzz::bag},           {"camchain", etalon::fuzz::camchain},
    {"euroc", etalon::fuzz::euroc},       {"faults", etalon::fuzz::faults},
    {"ini", etalon::fuzz::ini},           {"json", etalon::fuzz::json},
    {"pipeline", etalon::fuzz::pipeline}, {"plugin", etalon::fuzz::plugin},
    {"rawlog", etalon::fuzz::rawlog},     {"tum", etalon::fuzz::tum},
};

const Target* chosen = nullptr;

}  // namespace

extern "C" int LLVMFuzzerInitialize(int* argc, char*** argv) {
  for (int i = 1; i < *argc; ++i)
    for (const Target& target : kTargets)
      if (std::string("--target=") + target.name == (*argv)[i]) chosen = &target;
  if (chosen) return 0;
  std::fputs("etalon_fuzz: expected --target=NAME\n", stderr);
  std::exit(2);
}

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  chosen->run(data, size);
  return 0;
}
