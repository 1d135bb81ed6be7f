#pragma once

#include <string>
#include <vector>

#include "etalon/initialization/initializer.h"

namespace etalon {

/** A plugin library that was found and may be used. */
struct PluginInfo {
  std::string name, path, version, description, class_name;
};

/** A file that looks like a plugin and cannot be used, with the reason in words. */
struct RejectedPlugin {
  std::string path, reason;
};

/**
 * Finds and loads initializer plugins. A library once loaded is never unloaded. Search order: explicit paths (command
 * line), INI, next to the executable (`../lib/etalon/initializers`, `.`), the install prefix.
 */
class PluginLoader {
 public:
  /** @param search_path folders or single libraries, in order of preference */
  explicit PluginLoader(std::vector<std::string> search_path);

  /** `extra` first, then where the running executable and the installation keep theirs. */
  static std::vector<std::string> defaultSearchPath(const std::vector<std::string>& extra);

  /** Loads whatever the search path holds. Duplicate names and unusable files are rejected, with reasons. */
  const std::vector<PluginInfo>& available();
  const std::vector<RejectedPlugin>& rejected();

  /**
   * A new instance of the initializer called `name` (or of the library at this path, if it holds a '/').
   * @throws PluginError in words: not found (with the nearest name and what is there), not a library, wrong ABI
   *         version, undefined symbol, duplicate name, class not registered
   */
  Initializer::Ptr create(const std::string& name);
  PluginInfo info(const std::string& name);

 private:
  void scan();
  std::vector<std::string> search_path_;
  bool scanned_ = false;
  std::vector<PluginInfo> available_;
  std::vector<RejectedPlugin> rejected_;
};

}  // namespace etalon
