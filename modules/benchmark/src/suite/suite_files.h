#pragma once

#include <nlohmann/json.hpp>
#include <string>

#include "etalon/benchmark/record.h"

namespace etalon {

// What the folders of benchmarks and trials share.

std::string pathIn(const std::string& folder, const std::string& name);

/** @throws DataError if it cannot be read */
std::string readText(const std::string& path);

/** @throws DataError at `line` of `path` */
nlohmann::json parseJson(const std::string& text, const std::string& path, int line);

/** Invalid UTF-8 is replaced. @param indent -1: one line */
std::string jsonText(const nlohmann::ordered_json& json, int indent);

/** Why the results of two suites cannot be parts of one: code, configuration, initializers,
 * recordings. @param of_protocols how the rest differs, if it does; it comes after the
 * configuration */
std::string differenceOfSuites(const SuiteRecord& a, const SuiteRecord& b,
                               const std::string& of_protocols);

}  // namespace etalon
