# The name of the binary interface. Before 1.0 a minor version may change it, as the package's version says (EtalonInstall.cmake).
set(etalon_soversion ${PROJECT_VERSION_MAJOR})
if(PROJECT_VERSION_MAJOR EQUAL 0)
  set(etalon_soversion ${PROJECT_VERSION_MAJOR}.${PROJECT_VERSION_MINOR})
endif()

# etalon_add_module(NAME [PUBLIC ...] [PRIVATE ...])
# A shared library etalon_<name>, alias etalon::<name>, of all src/*.cpp and src/*/*.cpp, with its public headers in
# include/etalon/<name>/. PUBLIC and PRIVATE are the targets to link.
function(etalon_add_module name)
  cmake_parse_arguments(ARG "" "" "PUBLIC;PRIVATE" ${ARGN})
  set(target etalon_${name})
  file(GLOB sources CONFIGURE_DEPENDS src/*.cpp src/*/*.cpp)
  add_library(${target} SHARED ${sources})
  add_library(etalon::${name} ALIAS ${target})
  set_target_properties(${target} PROPERTIES EXPORT_NAME ${name} VERSION ${PROJECT_VERSION} SOVERSION
                                             ${etalon_soversion})
  target_include_directories(
    ${target}
    PUBLIC $<BUILD_INTERFACE:${CMAKE_CURRENT_SOURCE_DIR}/include> $<INSTALL_INTERFACE:${CMAKE_INSTALL_INCLUDEDIR}>
    PRIVATE src)
  target_compile_features(${target} PUBLIC cxx_std_17)
  target_link_libraries(${target} PUBLIC ${ARG_PUBLIC} PRIVATE ${ARG_PRIVATE} $<BUILD_INTERFACE:etalon_build_settings>)
  set_property(GLOBAL APPEND PROPERTY ETALON_MODULE_TARGETS ${target})
  etalon_reuse_precompiled_headers(${target} modules)
  set_property(GLOBAL APPEND PROPERTY ETALON_MODULE_INCLUDE_DIRS "${CMAKE_CURRENT_SOURCE_DIR}/include/etalon")
endfunction()

# etalon_add_tests(NAME [SOURCES ...] [LINK ...])
# One GoogleTest executable etalon_<name>_tests and one ctest <name>.unit, which runs all of it (etalon_add_test_program()).
# Without SOURCES it is made of tests/*.cpp and tests/*/*_unittest.cpp, and finds the private headers of the module beside it. All tests
# find the headers of tests/support, of which temporary_folder.h needs no library.
function(etalon_add_tests name)
  if(NOT ETALON_BUILD_TESTS)
    return()
  endif()
  cmake_parse_arguments(ARG "" "" "SOURCES;LINK" ${ARGN})
  set(target etalon_${name}_tests)
  if(NOT ARG_SOURCES)
    file(GLOB ARG_SOURCES CONFIGURE_DEPENDS tests/*.cpp tests/*/*_unittest.cpp)
  endif()
  add_executable(${target} ${ARG_SOURCES})
  if(IS_DIRECTORY "${CMAKE_CURRENT_SOURCE_DIR}/src")
    target_include_directories(${target} PRIVATE src)
  endif()
  target_include_directories(${target} PRIVATE "${CMAKE_SOURCE_DIR}/tests/support/include")
  target_link_libraries(${target} PRIVATE ${ARG_LINK} GTest::gtest GTest::gmock GTest::gtest_main
                                          etalon_build_settings)
  etalon_compile_as_tests(${target})
  etalon_add_test_program(${name}.unit ${target})
endfunction()

# etalon_add_benchmark(NAME SOURCES ... [LINK ...])
function(etalon_add_benchmark name)
  if(NOT ETALON_BUILD_BENCHMARKS)
    return()
  endif()
  cmake_parse_arguments(ARG "" "" "SOURCES;LINK" ${ARGN})
  set(target etalon_${name}_benchmark)
  add_executable(${target} ${ARG_SOURCES})
  target_link_libraries(${target} PRIVATE ${ARG_LINK} benchmark::benchmark_main etalon_build_settings)
endfunction()

# etalon_add_measurement(NAME SOURCES ... [LINK ...])
# A program that prints figures of the documents (not of speed); built with the benchmarks.
function(etalon_add_measurement name)
  if(NOT ETALON_BUILD_BENCHMARKS)
    return()
  endif()
  cmake_parse_arguments(ARG "" "" "SOURCES;LINK" ${ARGN})
  add_executable(${name} ${ARG_SOURCES})
  target_include_directories(${name} PRIVATE "${CMAKE_SOURCE_DIR}/tests/support/include")
  target_link_libraries(${name} PRIVATE ${ARG_LINK} etalon_build_settings)
  etalon_optimize_little(${name}) # the work is done in the libraries
endfunction()

# etalon_add_test_plugin(TARGET SOURCE FOLDER)
# A plugin for tests: FOLDER/NAME.so, where SOURCE is NAME.cpp.
function(etalon_add_test_plugin target source folder)
  get_filename_component(name "${source}" NAME_WE)
  add_library(${target} MODULE "${source}")
  target_link_libraries(${target} PRIVATE etalon::initialization etalon_build_settings)
  etalon_reuse_precompiled_headers(${target} modules)
  set_target_properties(${target} PROPERTIES PREFIX "" OUTPUT_NAME ${name} LIBRARY_OUTPUT_DIRECTORY "${folder}")
endfunction()

include(EtalonAddInitializer)
