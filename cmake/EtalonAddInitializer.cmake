include(GNUInstallDirs)

# etalon_add_initializer(NAME SOURCES ... [LINK ...] [CONTRACT_ARGS ...])
# A plugin: the shared library lib/etalon/initializers/<name>.so, refused by the linker when a symbol is undefined.
# For use inside Etalon's own build and, after find_package(etalon), in the build of a plugin elsewhere; there
#   etalon plugins --plugin-path <build folder>/lib/etalon/initializers
# finds it.
#
# Where tests are built (elsewhere: after include(CTest)) the test contract.<name> runs the contract suite on it.
# CONTRACT_ARGS are more arguments for `etalon check-plugin`, such as `--allow-nees 3`; the plugin's README says why.
function(etalon_add_initializer name)
  cmake_parse_arguments(ARG "" "" "SOURCES;LINK;CONTRACT_ARGS" ${ARGN})
  set(target etalon_initializer_${name})
  add_library(${target} MODULE ${ARG_SOURCES})
  target_link_libraries(${target} PRIVATE etalon::initialization ${ARG_LINK})
  if(TARGET etalon_build_settings)
    target_link_libraries(${target} PRIVATE etalon_build_settings)
  endif()
  set(link_checks -Wl,-z,now)
  if(NOT ETALON_SANITIZE) # the sanitizers' own symbols are resolved by the executable
    list(APPEND link_checks -Wl,-z,defs)
  endif()
  target_link_options(${target} PRIVATE ${link_checks})
  set_target_properties(
    ${target}
    PROPERTIES PREFIX ""
               OUTPUT_NAME ${name}
               LIBRARY_OUTPUT_DIRECTORY "${CMAKE_BINARY_DIR}/lib/etalon/initializers")
  install(TARGETS ${target} LIBRARY DESTINATION ${CMAKE_INSTALL_LIBDIR}/etalon/initializers)

  if(ETALON_BUILD_TESTS OR BUILD_TESTING)
    set(program etalon) # the target of Etalon's own build, or
    if(ETALON_EXECUTABLE)
      set(program "${ETALON_EXECUTABLE}") # the installed one
    endif()
    # More than the 24 checks may use together: the test ends by the suite's own word.
    set(limits)
    set(timeout 1500) # 60 s each on the clock
    if(ETALON_SANITIZE) # several times slower
      set(limits --cpu-limit 300)
      set(timeout 15000)
    endif()
    add_test(NAME contract.${name} COMMAND ${program} check-plugin "$<TARGET_FILE:${target}>" ${limits}
                                           ${ARG_CONTRACT_ARGS})
    set_tests_properties(contract.${name} PROPERTIES LABELS contract TIMEOUT ${timeout} COST 50)
  endif()
endfunction()

# etalon_add_test_program(NAME TARGET [FILTER])
# The ctest NAME runs the tests of the GoogleTest executable TARGET, or those that FILTER names (--gtest_filter), in one
# process: loading some 200 shared libraries takes longer than most tests do. It prints the failures alone.
function(etalon_add_test_program name target)
  set(filter)
  if(ARGC GREATER 2)
    set(filter "--gtest_filter=${ARGV2}")
  endif()
  set(timeout 900) # s
  if(ETALON_SANITIZE) # several times slower
    set(timeout 9000)
  endif()
  add_test(NAME ${name} COMMAND ${target} --gtest_brief=1 ${filter})
  # glibc overwrites memory that is freed: what is read from it is wrong at once, not only where it has been reused.
  set_tests_properties(${name} PROPERTIES TIMEOUT ${timeout} ENVIRONMENT MALLOC_PERTURB_=165)
endfunction()

# etalon_add_initializer_tests(NAME SOURCES ... [LINK ...])
# Unit tests of the plugin NAME: one GoogleTest executable etalon_initializer_<name>_tests, run by the ctest <name>.unit. They load the plugin as users get it, from the file ETALON_INITIALIZER (a string constant);
# etalon::contract has windows with exact truth for them. Parts of the plugin that are tested by themselves are named among
# the SOURCES too; their headers are found.
# Nothing where no tests are built, as above. Call it in the folder of the plugin, after etalon_add_initializer().
function(etalon_add_initializer_tests name)
  if(NOT (ETALON_BUILD_TESTS OR BUILD_TESTING))
    return()
  endif()
  cmake_parse_arguments(ARG "" "" "SOURCES;LINK" ${ARGN})
  if(NOT TARGET GTest::gtest_main)
    find_package(GTest REQUIRED)
  endif()
  set(plugin etalon_initializer_${name})
  set(target ${plugin}_tests)
  add_executable(${target} ${ARG_SOURCES})
  target_include_directories(${target} PRIVATE "${CMAKE_CURRENT_SOURCE_DIR}")
  target_compile_definitions(${target} PRIVATE ETALON_INITIALIZER="$<TARGET_FILE:${plugin}>")
  target_link_libraries(${target} PRIVATE ${ARG_LINK} etalon::contract GTest::gtest GTest::gmock GTest::gtest_main)
  foreach(own etalon_build_settings etalon_initializer_checks) # of Etalon's own build
    if(TARGET ${own})
      target_link_libraries(${target} PRIVATE ${own})
    endif()
  endforeach()
  add_dependencies(${target} ${plugin})
  etalon_add_test_program(${name}.unit ${target})
endfunction()
