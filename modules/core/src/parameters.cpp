#include "etalon/core/parameters.h"

namespace etalon {
void ParameterSet::add(const std::string&, double*, Range<double>, const std::string&) {}
void ParameterSet::add(const std::string&, int*, Range<int>, const std::string&) {}
void ParameterSet::add(const std::string&, bool*, const std::string&) {}
void ParameterSet::add(const std::string&, std::string*, const std::string&) {}
void ParameterSet::add(const std::string&, std::string*, const std::vector<std::string>&,
                       const std::string&) {}
}  // namespace etalon
