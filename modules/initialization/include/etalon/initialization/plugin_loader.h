#pragma once

#include <list>
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
 * Finds and loads initializer plugins. A library once loaded is never unloaded. Order of search:
 * explicit paths (command line, INI), then where the executable and Etalon's libraries keep theirs.
 *
 * Of two plugins with the same name the first found is used; the other is listed as rejected. Not
 * for concurrent use.
 */
class PluginLoader {
 public:
  /** @param search_path folders or single libraries, in order of preference */
  explicit PluginLoader(std::vector<std::string> search_path);

  /**
   * `extra` first; then `../lib/etalon/initializers` and its installed counterpart beside the
   * running executable; then `etalon/initializers` beside the library of this class. Of the latter
   * those that exist, each once.
   */
  static std::vector<std::string> defaultSearchPath(const std::vector<std::string>& extra);

  /** Loads whatever the search path holds, in order of search, then of file name. */
  const std::vector<PluginInfo>& available();
  /** What the search path names or holds and cannot be used: duplicate names, unusable files. */
  const std::vector<RejectedPlugin>& rejected();

  /**
   * A new instance of the initializer called `name` (or of the library at this path, if it holds a
   * '/').
   * @throws PluginError in words: not found (with the nearest name and what is there), not a
   *         library, wrong ABI version, undefined symbol, duplicate name, class not registered
   */
  Initializer::Ptr create(const std::string& name);
  /** Of the plugin that create() would use; throws like it. */
  PluginInfo info(const std::string& name);

 private:
  /** A plugin with the class that makes its instances. */
  struct Loaded {
    PluginInfo info;
    const mrpt::rtti::TRuntimeClassId* class_id = nullptr;
  };

  void scan();
  void scanEntry(const std::string& entry);
  void tryLibrary(const std::string& path);
  const Loaded& load(const std::string& path);
  const Loaded& find(const std::string& name);
  [[noreturn]] void failNotFound(const std::string& name) const;

  std::vector<std::string> search_path_;
  bool scanned_ = false;
  std::list<Loaded> loaded_;  ///< references into it stay valid
  std::vector<PluginInfo> available_;
  std::vector<RejectedPlugin> rejected_;
};

}  // namespace etalon
