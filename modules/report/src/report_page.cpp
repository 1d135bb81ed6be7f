#include "report_page.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>

#include "etalon/core/printable.h"
#include "etalon/core/text.h"
#include "report_assets.h"

namespace etalon {
namespace {

/** `page` with each {{name}} replaced once; a text that is put in is not searched again. */
std::string filled(std::string_view page, const std::map<std::string, std::string>& texts) {
  size_t size = page.size();
  for (const auto& [name, text] : texts) size += text.size();
  std::string result;
  result.reserve(size);
  for (size_t begin = 0; begin < page.size();) {
    const size_t open = page.find("{{", begin);
    const size_t close = page.find("}}", std::min(open, page.size()));
    if (close == std::string_view::npos) {
      result += page.substr(begin);
      break;
    }
    result += page.substr(begin, open - begin);
    const auto text = texts.find(std::string(page.substr(open + 2, close - open - 2)));
    if (text != texts.end()) result += text->second;
    begin = close + 2;
  }
  return result;
}

}  // namespace

std::string scriptText(const nlohmann::json& json) {
  const std::string text = json.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
  std::string safe;
  safe.reserve(text.size());
  for (const char c : text) {
    if (c == '<')
      safe += "\\u003c";
    else
      safe += c;
  }
  return safe;
}

std::string pageText(const std::string& text) {
  return nlohmann::json::parse(nlohmann::json(printable(text, true))
                                   .dump(-1, ' ', false, nlohmann::json::error_handler_t::replace))
      .get<std::string>();
}

std::string escaped(const std::string& text) { return htmlText(pageText(text)); }

nlohmann::json rounded(double value) {
  if (!std::isfinite(value)) return nullptr;
  const std::string text = format("%.6g", value);
  return std::strtod(text.c_str(), nullptr);  // stod throws where a number is smaller than 2e-308
}

std::string number(double value) { return format("%g", value); }

std::string term(const std::string& name, const std::string& html) {
  return html.empty() ? "" : "<dt>" + name + "</dt><dd>" + html + "</dd>\n";
}

std::string versionsText(const std::map<std::string, std::string>& versions) {
  return joined(versions, ", ", [](const auto& v) { return escaped(v.first + " " + v.second); });
}

std::string reportPage(std::string_view page, std::string_view script,
                       std::map<std::string, std::string> texts, const nlohmann::json& data) {
  texts["title"] = escaped(texts["title"]);
  texts["data"] = scriptText(data);
  texts["style"] = report_assets::style();
  texts["script"] = script;
  texts["library"] = report_assets::library();
  texts["licences"] = escaped(std::string(report_assets::licences()));
  return filled(page, texts);
}

}  // namespace etalon
