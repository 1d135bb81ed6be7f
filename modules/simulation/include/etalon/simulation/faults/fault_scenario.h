#pragma once

#include <string>
#include <vector>

#include "etalon/core/parameters.h"
#include "etalon/simulation/faults/fault.h"

namespace etalon {

/** One named row of a fault file: what happens to a recording. */
struct FaultScenario {
  std::string name;
  std::string text;  ///< as written; empty: nothing happens
  std::vector<Fault> faults;
  std::vector<std::string> fault_texts;  ///< of each fault, as written
};

/**
 * Reads the section [faults] of an INI file, `name = text` a line (config/faults.ini documents it).
 * @return in the order of the file
 * @throws ConfigError naming file, line, key and what was expected
 */
std::vector<FaultScenario> readFaultFile(const std::string& path);

/**
 * Reads faults from text: "covered lens=left from=8 for=1, imu_gap from=8 for=0.5".
 * @param origin stands for the place of the text in messages: "file:line"
 * @throws ConfigError naming origin, fault, key and what was expected
 */
FaultScenario parseFaultScenario(const std::string& name, const std::string& text,
                                 const std::string& origin = "--fault");

/** A kind of fault, for documentation and messages. */
struct FaultKind {
  std::string name;
  std::vector<ParameterSet::Description> parameters;
  std::vector<std::string> needs;  ///< keys; at least one must be given unless it is empty
};

/** Every kind, in the order of the variant Fault. */
std::vector<FaultKind> faultKinds();

}  // namespace etalon
