#include "etalon/initialization/plugin_loader.h"

#include <algorithm>
#include <exception>
#include <filesystem>
#include <utility>

#include "etalon/core/errors.h"
#include "etalon/core/printable.h"
#include "etalon/core/text.h"
#include "shared_library.h"

#ifndef ETALON_INSTALLED_INITIALIZERS
#error "the build defines the plugins' folder relative to the installed executable's"
#endif

namespace etalon {

namespace {

namespace fs = std::filesystem;
constexpr char kAdvice[] =
    "; see ETALON_REGISTER_INITIALIZER in etalon/initialization/initializer.h";

std::string canonical(const std::string& path) {
  std::error_code error;
  const fs::path result = fs::weakly_canonical(path, error);
  return error ? path : result.string();
}

/** The plugin's name is the name of its INI section. */
bool isPluginName(const std::string& name) {
  return !name.empty() && std::all_of(name.begin(), name.end(), [](char c) {
    return ('a' <= c && c <= 'z') || ('0' <= c && c <= '9') || c == '_';
  });
}

/** The descriptor. Its version is checked before any other member is read. */
const InitializerDescriptor& readDescriptor(const SharedLibrary& library, const std::string& path) {
  using DescriptorFunction = const InitializerDescriptor* (*)();
  const auto function = reinterpret_cast<DescriptorFunction>(library.symbol(kDescriptorSymbol));
  if (!function) {
    throw PluginError(path + ": is no initializer plugin: it does not export " + kDescriptorSymbol +
                      kAdvice);
  }
  const InitializerDescriptor* const descriptor = function();
  if (!descriptor) throw PluginError(path + ": gives a null descriptor" + kAdvice);
  if (descriptor->abi_version != ETALON_INITIALIZER_ABI) {
    throw PluginError(path + ": was built for version " + std::to_string(descriptor->abi_version) +
                      " of the initializer ABI, this Etalon has version " +
                      std::to_string(ETALON_INITIALIZER_ABI) + "; rebuild it against this one");
  }
  if (!descriptor->name || !descriptor->class_name || !descriptor->version ||
      !descriptor->description || !isPluginName(descriptor->name)) {
    throw PluginError(path +
                      ": its descriptor is incomplete: expected a name of a-z, 0-9, '_', a " +
                      "class name, a version and a description" + kAdvice);
  }
  return *descriptor;
}

/** The class that the library has registered under the name it gives. */
const mrpt::rtti::TRuntimeClassId* registeredClass(const InitializerDescriptor& descriptor,
                                                   const std::string& path) {
  const std::string name = descriptor.class_name;
  const mrpt::rtti::TRuntimeClassId* const id = mrpt::rtti::findRegisteredClass(name, false);
  if (!id) throw PluginError(path + ": has not registered its class " + name + kAdvice);
  const std::string owner = libraryOf(id);
  if (owner != libraryOf(&descriptor)) {
    throw PluginError(path + ": its class " + name + " has the name of one already loaded from " +
                      owner + "; rename one of the two, or leave one out of the search path");
  }
  if (!id->derivedFrom(CLASS_ID(Initializer))) {
    throw PluginError(path + ": its class " + name + " does not derive from etalon::Initializer" +
                      kAdvice);
  }
  if (!id->ptrCreateObject) {
    throw PluginError(path + ": its class " + name + " is abstract" + kAdvice);
  }
  return id;
}

std::string joinedOrNone(const std::vector<std::string>& words) {
  return words.empty() ? "none" : joined(words);
}

}  // namespace

PluginLoader::PluginLoader(std::vector<std::string> search_path)
    : search_path_(std::move(search_path)) {}

std::vector<std::string> PluginLoader::defaultSearchPath(const std::vector<std::string>& extra) {
  std::vector<std::string> path = extra;
  std::vector<std::string> seen;
  std::error_code error;
  const fs::path executable = fs::read_symlink("/proc/self/exe", error);
  std::vector<fs::path> folders;
  if (!error) {
    folders.push_back(executable.parent_path() / "../lib/etalon/initializers");
    folders.push_back(executable.parent_path() / ETALON_INSTALLED_INITIALIZERS);
  }
  const fs::path library = libraryOf(reinterpret_cast<const void*>(&registerInitializerClass));
  if (!library.empty()) folders.push_back(library.parent_path() / "etalon/initializers");
  for (const fs::path& folder : folders) {
    const std::string resolved = canonical(folder.string());
    if (!fs::is_directory(resolved, error)) continue;
    if (std::find(seen.begin(), seen.end(), resolved) != seen.end()) continue;
    seen.push_back(resolved);
    path.push_back(resolved);
  }
  return path;
}

const std::vector<PluginInfo>& PluginLoader::available() {
  scan();
  return available_;
}

const std::vector<RejectedPlugin>& PluginLoader::rejected() {
  scan();
  return rejected_;
}

void PluginLoader::scan() {
  if (scanned_) return;
  scanned_ = true;
  for (const std::string& entry : search_path_) scanEntry(entry);
}

void PluginLoader::scanEntry(const std::string& entry) {
  std::error_code error;
  if (!fs::exists(entry, error)) {
    rejected_.push_back({entry, "no such file or folder"});
    return;
  }
  if (!fs::is_directory(entry, error)) {
    tryLibrary(entry);
    return;
  }
  std::vector<std::string> libraries;
  for (fs::directory_iterator i(entry, error), end; !error && i != end; i.increment(error)) {
    if (i->path().extension() == ".so") libraries.push_back(i->path().string());
  }
  if (error) rejected_.push_back({entry, "cannot be listed: " + error.message()});
  std::sort(libraries.begin(), libraries.end());
  for (const std::string& library : libraries) tryLibrary(library);
}

void PluginLoader::tryLibrary(const std::string& path) {
  try {
    load(path);
  } catch (const PluginError& e) {
    const std::string what = e.what();
    const std::string prefix = path + ": ";
    rejected_.push_back({path, what.rfind(prefix, 0) == 0 ? what.substr(prefix.size()) : what});
  }
}

const PluginLoader::Loaded& PluginLoader::load(const std::string& path) {
  const std::string resolved = canonical(path);
  for (const Loaded& other : loaded_) {
    if (canonical(other.info.path) == resolved) return other;
  }
  // A name without '/' would make dlopen() search the system's libraries.
  const SharedLibrary library =
      SharedLibrary::open(path.find('/') == std::string::npos ? "./" + path : path);
  const InitializerDescriptor& descriptor = readDescriptor(library, path);
  for (const Loaded& other : loaded_) {
    if (other.info.name == descriptor.name) {
      throw PluginError(path + ": its name '" + other.info.name + "' belongs to " +
                        other.info.path + ", which was found first");
    }
  }
  const auto* const class_id = registeredClass(descriptor, path);
  loaded_.push_back({{descriptor.name, path, printable(descriptor.version),
                      printable(descriptor.description), descriptor.class_name},
                     class_id});
  available_.push_back(loaded_.back().info);
  return loaded_.back();
}

const PluginLoader::Loaded& PluginLoader::find(const std::string& name) {
  if (name.find('/') != std::string::npos) return load(name);
  scan();
  for (const Loaded& plugin : loaded_) {
    if (plugin.info.name == name) return plugin;
  }
  failNotFound(name);
}

void PluginLoader::failNotFound(const std::string& name) const {
  for (const RejectedPlugin& plugin : rejected_) {
    if (fs::path(plugin.path).stem() == name) {
      throw PluginError("initializer '" + name + "' cannot be used: " + plugin.path + ": " +
                        plugin.reason);
    }
  }
  std::vector<std::string> names;
  for (const PluginInfo& plugin : available_) names.push_back(plugin.name);
  const std::string nearest = nearestWord(name, names);
  throw PluginError("no initializer is called '" + name + "'" +
                    (nearest.empty() ? "" : " (did you mean '" + nearest + "'?)") +
                    "; available: " + joinedOrNone(names) +
                    "; searched: " + joinedOrNone(search_path_) +
                    "; add the folder of another plugin by --plugin-path or [plugins] path");
}

PluginInfo PluginLoader::info(const std::string& name) { return find(name).info; }

Initializer::Ptr PluginLoader::create(const std::string& name) {
  const Loaded& plugin = find(name);
  mrpt::rtti::CObject::Ptr object;
  try {
    object = plugin.class_id->createObject();
  } catch (const std::exception& e) {
    throw PluginError(plugin.info.path + ": its class " + plugin.info.class_name +
                      " cannot be constructed: " + e.what());
  }
  auto initializer = std::dynamic_pointer_cast<Initializer>(object);
  if (!initializer) {
    throw PluginError(plugin.info.path + ": its class " + plugin.info.class_name +
                      " does not derive from etalon::Initializer, although it says so" + kAdvice);
  }
  return initializer;
}

}  // namespace etalon
