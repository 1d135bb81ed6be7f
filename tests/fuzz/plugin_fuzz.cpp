// A file that is offered as a plugin. What passes for a whole shared library of this machine is not
// given to the loader of the system, which trusts its libraries.

#include "etalon/initialization/plugin_loader.h"
#include "fuzz_input.h"
#include "fuzz_targets.h"

void etalon::fuzz::plugin(const std::uint8_t* data, std::size_t size) {
  std::string content(reinterpret_cast<const char*>(data), size);
  // e_type of the ELF header: anything but a shared library.
  if (content.size() > 17 && content[16] == 3 && content[17] == 0) content[16] = 2;
  const std::string path = inFile("plugin.so", content);
  PluginLoader loader({path});
  loader.available();
  if (loader.rejected().empty()) std::abort();
}
