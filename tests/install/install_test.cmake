# Installs Etalon, moves the installed tree, and follows the guide for plugins with it. Called with cmake -D ... -P; stops
# with an error where something is not as it should be.
#   SOURCE_FOLDER, BUILD_FOLDER: of Etalon; WORK_FOLDER: emptied first; LIBDIR, BINDIR, DOCDIR: relative to the prefix

file(REMOVE_RECURSE "${WORK_FOLDER}")
file(MAKE_DIRECTORY "${WORK_FOLDER}")
set(installed "${WORK_FOLDER}/installed")
set(moved "${WORK_FOLDER}/moved")

function(run output)
  execute_process(
    COMMAND ${ARGN}
    OUTPUT_VARIABLE out
    ERROR_VARIABLE err
    RESULT_VARIABLE code)
  if(NOT code EQUAL 0)
    list(JOIN ARGN " " command)
    message(FATAL_ERROR "${command}\nended with ${code}\n${out}\n${err}")
  endif()
  set(${output} "${out}" PARENT_SCOPE)
endfunction()

function(expect_contains text pattern)
  string(FIND "${text}" "${pattern}" position)
  if(position EQUAL -1)
    message(FATAL_ERROR "expected '${pattern}' in\n${text}")
  endif()
endfunction()

function(expect_lacks text pattern)
  string(FIND "${text}" "${pattern}" position)
  if(NOT position EQUAL -1)
    message(FATAL_ERROR "expected no '${pattern}' in\n${text}")
  endif()
endfunction()

run(ignored "${CMAKE_COMMAND}" --install "${BUILD_FOLDER}" --prefix "${installed}")
file(RENAME "${installed}" "${moved}")
set(etalon "${moved}/${BINDIR}/etalon")

# The moved executable, and the window that it loads for --gui, find their own libraries and plugins, not those of the build.
run(list "${etalon}" plugins)
expect_contains("${list}" "${moved}/${LIBDIR}/etalon/initializers/eta.so")
expect_lacks("${list}" "${BUILD_FOLDER}/lib")
expect_lacks("${list}" "Not usable")
set(loaded "${etalon}")
if(EXISTS "${BUILD_FOLDER}/lib/libetalon_flight_window.so")
  list(APPEND loaded "${moved}/${LIBDIR}/libetalon_flight_window.so")
endif()
foreach(file IN LISTS loaded)
  run(libraries ldd "${file}")
  expect_contains("${libraries}" "${moved}/")
  expect_lacks("${libraries}" "${BUILD_FOLDER}/lib")
  expect_lacks("${libraries}" "not found")
endforeach()

# The guide and what it refers to are there to be read, and their links hold.
set(documentation "${moved}/${DOCDIR}")
foreach(file README.md LICENSE docs/writing-a-plugin.md docs/notation.md examples/plugin/loosely_coupled.cpp
             plugins/initializers/eta/README.md)
  if(NOT EXISTS "${documentation}/${file}")
    message(FATAL_ERROR "${documentation}/${file} was not installed")
  endif()
endforeach()
run(ignored bash "${CMAKE_CURRENT_LIST_DIR}/check_links.sh" "${documentation}")

# A program that uses the headers of run logs and reports needs nothing but the package.
run(ignored "${CMAKE_COMMAND}" -S "${CMAKE_CURRENT_LIST_DIR}/headers" -B "${WORK_FOLDER}/headers" "-DCMAKE_PREFIX_PATH=${moved}")
run(ignored "${CMAKE_COMMAND}" --build "${WORK_FOLDER}/headers")

# A plugin written, built, checked and run elsewhere against the moved package, as docs/writing-a-plugin.md says.
run(guide "${CMAKE_COMMAND}" -E env "ETALON=${moved}" bash "${CMAKE_CURRENT_LIST_DIR}/run_guide.sh"
    "${documentation}/docs/writing-a-plugin.md" "${SOURCE_FOLDER}/examples/plugin" "${WORK_FOLDER}/guide")
expect_contains("${guide}" "gyro bias, velocities and gravity by least squares")
expect_contains("${guide}" "max_gyro_bias_rps = 0.5")
expect_contains("${guide}" "0 failed")
expect_contains("${guide}" "100% tests passed")

# It was installed beside the others: found without being named by path.
run(description "${etalon}" plugins --describe loosely_coupled)
expect_contains("${description}" "${moved}/${LIBDIR}/etalon/initializers/loosely_coupled.so")

file(REMOVE_RECURSE "${WORK_FOLDER}")
