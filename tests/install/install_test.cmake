# Installs Etalon, moves the installed tree, builds the plugin beside this file against it, and lets the moved
# executable find it. Called with cmake -D ... -P; stops with an error where something is not as it should be.
#   BUILD_FOLDER, BUILD_TYPE: of Etalon; WORK_FOLDER: emptied first; LIBDIR, BINDIR: relative to the prefix

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

# The moved executable finds its own libraries and plugins, not those of the build.
run(list "${etalon}" plugins)
expect_contains("${list}" "${moved}/${LIBDIR}/etalon/initializers/eta.so")
expect_lacks("${list}" "${BUILD_FOLDER}/lib")
expect_lacks("${list}" "Not usable")
run(libraries ldd "${etalon}")
expect_contains("${libraries}" "${moved}/")
expect_lacks("${libraries}" "${BUILD_FOLDER}/lib")
expect_lacks("${libraries}" "not found")

# A plugin built elsewhere against the moved package.
set(plugin_build "${WORK_FOLDER}/plugin")
run(ignored "${CMAKE_COMMAND}" -S "${CMAKE_CURRENT_LIST_DIR}/plugin" -B "${plugin_build}" "-DCMAKE_PREFIX_PATH=${moved}"
    "-DCMAKE_BUILD_TYPE=${BUILD_TYPE}" "-DCMAKE_INSTALL_PREFIX=${moved}" "-DCMAKE_INSTALL_LIBDIR=${LIBDIR}")
run(ignored "${CMAKE_COMMAND}" --build "${plugin_build}")
run(list "${etalon}" plugins --plugin-path "${plugin_build}/lib/etalon/initializers")
expect_contains("${list}" "believes that the platform is level")
expect_lacks("${list}" "Not usable")
run(description "${etalon}" plugins --plugin-path "${plugin_build}/lib/etalon/initializers" --describe level)
expect_contains("${description}" "max_rate_rps = 0.05")

# Installed beside the others it is found without being named.
run(ignored "${CMAKE_COMMAND}" --install "${plugin_build}")
run(description "${etalon}" plugins --describe level)
expect_contains("${description}" "${moved}/${LIBDIR}/etalon/initializers/level.so")

file(REMOVE_RECURSE "${WORK_FOLDER}")
