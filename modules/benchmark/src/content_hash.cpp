#include "etalon/benchmark/content_hash.h"

#include <link.h>
#include <xxhash.h>

#include <algorithm>
#include <cstdint>
#include <filesystem>
#include <fstream>

#include "etalon/core/errors.h"
#include "etalon/core/text.h"
#include "etalon/datasets/recorded_source.h"

namespace etalon {
namespace {

namespace fs = std::filesystem;

int collectLibrary(dl_phdr_info* info, size_t /*size*/, void* libraries) {
  const std::string path = info->dlpi_name;
  if (fs::path(path).filename().string().rfind("libetalon_", 0) == 0)
    static_cast<std::vector<std::string>*>(libraries)->push_back(path);
  return 0;
}

/** Paths of Etalon's libraries in this process, by name. */
std::vector<std::string> loadedLibraries() {
  std::vector<std::string> libraries;
  dl_iterate_phdr(collectLibrary, &libraries);
  std::sort(libraries.begin(), libraries.end(), [](const std::string& a, const std::string& b) {
    return fs::path(a).filename() < fs::path(b).filename();
  });
  return libraries;
}

}  // namespace

struct ContentHash::State {
  XXH3_state_t* xxh3 = XXH3_createState();
  std::vector<char> buffer = std::vector<char>(1 << 20);

  State() { XXH3_128bits_reset(xxh3); }
  ~State() { XXH3_freeState(xxh3); }
  State(const State&) = delete;
  State& operator=(const State&) = delete;
};

ContentHash::ContentHash() : state_(std::make_unique<State>()) {}
ContentHash::~ContentHash() = default;

void ContentHash::add(const void* data, std::size_t size) {
  XXH3_128bits_update(state_->xxh3, data, size);
}

void ContentHash::add(const std::string& text) {
  const std::uint64_t size = text.size();
  add(&size, sizeof size);
  add(text.data(), text.size());
}

void ContentHash::addFile(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  std::uint64_t size = 0;
  while (file) {
    file.read(state_->buffer.data(), static_cast<std::streamsize>(state_->buffer.size()));
    add(state_->buffer.data(), file.gcount());
    size += static_cast<std::uint64_t>(file.gcount());
  }
  if (!file.eof()) throw DataError(path, 0, "cannot be read");
  add(&size, sizeof size);
}

std::string ContentHash::hex() const {
  const XXH128_hash_t digest = XXH3_128bits_digest(state_->xxh3);
  return format("%016llx%016llx", static_cast<unsigned long long>(digest.high64),
                static_cast<unsigned long long>(digest.low64));
}

std::string recordingHash(const RecordedSource& recording) {
  ContentHash hash;
  for (const RecordingFile& file : recording.files()) {
    if (!file.name.empty()) hash.add(file.name);
    hash.addFile(file.path);
  }
  return hash.hex();
}

std::string librariesHash(const std::vector<std::string>& modules) {
  ContentHash hash;
  for (const std::string& path : loadedLibraries()) {
    const std::string name = fs::path(path).filename().string();
    for (const std::string& module : modules)
      if (name.rfind("libetalon_" + module + ".", 0) == 0) {
        hash.add(module);
        hash.addFile(path);
      }
  }
  return hash.hex();
}

std::string programHash() {
  ContentHash hash;
  hash.addFile("/proc/self/exe");
  for (const std::string& path : loadedLibraries()) {
    hash.add(fs::path(path).filename().string());
    hash.addFile(path);
  }
  return hash.hex();
}

std::string fileHash(const std::string& path) {
  ContentHash hash;
  hash.addFile(path);
  return hash.hex();
}

}  // namespace etalon
