#pragma once

#include <string>

namespace etalon {

/**
 * A shared library opened at run time and never closed: objects, exceptions and registered classes
 * of it may outlive whoever opened it.
 */
class SharedLibrary {
 public:
  /**
   * Resolves all symbols at once (RTLD_NOW), offers none to other libraries (RTLD_LOCAL).
   * @throws PluginError in words, with what to do: missing, not a library, truncated, of another
   *         machine, undefined symbol, a library that it needs is missing
   */
  static SharedLibrary open(const std::string& path);

  /** Address of an exported symbol, null if there is none. */
  void* symbol(const char* name) const;

 private:
  explicit SharedLibrary(void* handle) : handle_(handle) {}
  void* handle_ = nullptr;
};

/** The file of the library or executable that holds `address`; empty if there is none. */
std::string libraryOf(const void* address);

}  // namespace etalon
