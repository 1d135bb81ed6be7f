# Headers that nearly every source includes, compiled once for all modules and once for all tests, which spares 3 of the 20 s of a unit of tests.
# Sources still include what they use: builds of other compilers, of other types and of plugins elsewhere have no such headers.
option(ETALON_PRECOMPILED_HEADERS "Precompile the headers of Eigen, the standard library and GoogleTest (Release, GCC)" ON)
set(etalon_precompiled OFF)
if(ETALON_PRECOMPILED_HEADERS AND CMAKE_CXX_COMPILER_ID STREQUAL "GNU" AND CMAKE_BUILD_TYPE STREQUAL "Release")
  set(etalon_precompiled ON)
endif()

set(etalon_common_headers
    <Eigen/Dense>
    <algorithm>
    <array>
    <cmath>
    <filesystem>
    <fstream>
    <functional>
    <iostream>
    <map>
    <memory>
    <optional>
    <regex>
    <set>
    <sstream>
    <string>
    <unordered_map>
    <vector>)

# etalon_reuse_precompiled_headers(TARGET KIND)
# KIND: modules (shared libraries) or tests (executables). A precompiled header fits those targets only that are compiled with
# the same options, those of position and optimisation among them.
function(etalon_reuse_precompiled_headers target kind)
  if(NOT etalon_precompiled)
    return()
  endif()
  set(precompiled etalon_headers_of_${kind})
  if(NOT TARGET ${precompiled})
    file(CONFIGURE OUTPUT "${CMAKE_BINARY_DIR}/${precompiled}.cpp" CONTENT "int main() {}\n") # CMake wants a source, too
    if(kind STREQUAL "tests")
      add_executable(${precompiled} "${CMAKE_BINARY_DIR}/${precompiled}.cpp")
      etalon_optimize_little(${precompiled})
      target_precompile_headers(${precompiled} PRIVATE ${etalon_common_headers} <gmock/gmock.h> <gtest/gtest.h>)
      target_link_libraries(${precompiled} PRIVATE GTest::gtest GTest::gmock)
    else()
      add_library(${precompiled} OBJECT "${CMAKE_BINARY_DIR}/${precompiled}.cpp")
      target_precompile_headers(${precompiled} PRIVATE ${etalon_common_headers})
    endif()
    target_link_libraries(${precompiled} PRIVATE Eigen3::Eigen etalon_build_settings)
    set_target_properties(${precompiled} PROPERTIES RUNTIME_OUTPUT_DIRECTORY "${CMAKE_BINARY_DIR}/CMakeFiles")
  endif()
  target_precompile_headers(${target} REUSE_FROM ${precompiled})
endfunction()

# etalon_compile_as_tests(TARGET)
# With little optimisation, and with the headers that were precompiled for tests.
function(etalon_compile_as_tests target)
  etalon_optimize_little(${target})
  etalon_reuse_precompiled_headers(${target} tests)
endfunction()
