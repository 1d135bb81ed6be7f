#include "shared_library.h"

#include <cxxabi.h>
#include <dlfcn.h>
#include <link.h>

#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <memory>

#include "etalon/core/errors.h"
#include "etalon/initialization/initializer.h"

namespace etalon {

namespace {

namespace fs = std::filesystem;
using ElfHeader = ElfW(Ehdr);
using SegmentHeader = ElfW(Phdr);

template <typename T>
bool readAt(std::ifstream& stream, std::uint64_t offset, T* value) {
  stream.seekg(static_cast<std::streamoff>(offset));
  return static_cast<bool>(stream.read(reinterpret_cast<char*>(value), sizeof(T)));
}

/** The header of the running executable says what a library for it looks like. */
bool readOwnHeader(ElfHeader* header) {
  std::ifstream stream("/proc/self/exe", std::ios::binary);
  return readAt(stream, 0, header);
}

/**
 * Why the file is no whole shared library for this machine; empty if it seems to be one. dlopen()
 * cannot be asked: it dies of SIGBUS on a truncated library, and reports "No such file" for one of
 * another machine.
 */
std::string whyNotALibrary(const std::string& path) {
  std::error_code error;
  if (!fs::exists(path, error)) return "no such file";
  if (!fs::is_regular_file(path, error)) return "is not a regular file";
  const std::uint64_t size = fs::file_size(path, error);
  std::ifstream stream(path, std::ios::binary);
  if (error || !stream) return "cannot be read";
  ElfHeader header{};
  if (!readAt(stream, 0, &header) || std::memcmp(header.e_ident, ELFMAG, SELFMAG) != 0) {
    return "is not a shared library (no ELF header); build it with etalon_add_initializer()";
  }
  ElfHeader own{};
  if (readOwnHeader(&own) &&
      (header.e_ident[EI_CLASS] != own.e_ident[EI_CLASS] ||
       header.e_ident[EI_DATA] != own.e_ident[EI_DATA] || header.e_machine != own.e_machine)) {
    return "is a library for another machine; build it on this one";
  }
  if (header.e_type != ET_DYN || header.e_phentsize != sizeof(SegmentHeader)) {
    return "is not a shared library; build it with etalon_add_initializer()";
  }
  for (std::uint64_t i = 0; i < header.e_phnum; ++i) {
    SegmentHeader segment{};
    if (!readAt(stream, header.e_phoff + i * sizeof(SegmentHeader), &segment) ||
        segment.p_filesz > size || segment.p_offset > size - segment.p_filesz) {
      return "is truncated (" + std::to_string(size) + " bytes are not all); copy or build it anew";
    }
  }
  return "";
}

std::string demangled(const std::string& symbol) {
  int status = 0;
  const std::unique_ptr<char, decltype(&std::free)> text(
      abi::__cxa_demangle(symbol.c_str(), nullptr, nullptr, &status), &std::free);
  return status == 0 && text ? text.get() : symbol;
}

/** The N of "etalon::abi_vN::" in a demangled name, -1 if there is none. */
int abiVersionIn(const std::string& name) {
  const std::string marker = "etalon::abi_v";
  const size_t found = name.find(marker);
  return found == std::string::npos ? -1 : std::atoi(name.c_str() + found + marker.size());
}

/** What dlopen() says, in words and with what to do. */
std::string explained(const std::string& path, const std::string& dl_error) {
  const std::string undefined = "undefined symbol: ";
  const size_t found = dl_error.find(undefined);
  if (found != std::string::npos) {
    std::string symbol = dl_error.substr(found + undefined.size());
    symbol = symbol.substr(0, symbol.find_first_of(" ,\n"));
    const std::string name = demangled(symbol);
    const int abi = abiVersionIn(name);
    if (abi >= 0 && abi != ETALON_INITIALIZER_ABI) {
      return "was built for version " + std::to_string(abi) +
             " of the initializer ABI, this Etalon has version " +
             std::to_string(ETALON_INITIALIZER_ABI) + "; rebuild it against this one";
    }
    return "has the undefined symbol " + name +
           "; link the library that defines it, and build with etalon_add_initializer(), which "
           "makes the linker refuse such symbols";
  }
  const std::string missing = ": cannot open shared object file";
  const size_t end = dl_error.find(missing);
  if (end != std::string::npos && dl_error.substr(0, end) != path) {
    return "needs the library " + dl_error.substr(0, end) +
           ", which is not found; install it, or build the plugin anew";
  }
  return "cannot be loaded: " + dl_error;
}

}  // namespace

SharedLibrary SharedLibrary::open(const std::string& path) {
  const std::string reason = whyNotALibrary(path);
  if (!reason.empty()) throw PluginError(path + ": " + reason);
  void* const handle = dlopen(path.c_str(), RTLD_NOW | RTLD_LOCAL);
  if (!handle) {
    const char* const error = dlerror();
    throw PluginError(path + ": " + explained(path, error ? error : "no reason given"));
  }
  return SharedLibrary(handle);
}

void* SharedLibrary::symbol(const char* name) const { return dlsym(handle_, name); }

std::string libraryOf(const void* address) {
  Dl_info info{};
  return dladdr(address, &info) != 0 && info.dli_fname ? info.dli_fname : "";
}

}  // namespace etalon
