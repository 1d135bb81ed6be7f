#pragma once

#include <nlohmann/json.hpp>
#include <string>

namespace etalon::testing {

/** The data that the scripts of a report's page draw. */
inline nlohmann::json dataOf(const std::string& html) {
  const std::string open = "<script type=\"application/json\" id=\"data\">";
  const size_t begin = html.find(open) + open.size();
  return nlohmann::json::parse(html.substr(begin, html.find("</script>", begin) - begin));
}

}  // namespace etalon::testing
