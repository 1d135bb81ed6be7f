# Writes the example reports into FOLDER and opens them in headless Chromium.
file(REMOVE_RECURSE "${FOLDER}")
file(MAKE_DIRECTORY "${FOLDER}")
execute_process(COMMAND "${WRITER}" "${FOLDER}" COMMAND_ERROR_IS_FATAL ANY)
execute_process(COMMAND "${NODE}" "${CMAKE_CURRENT_LIST_DIR}/browser_test.mjs" "${CHROMIUM}" "${FOLDER}"
                COMMAND_ERROR_IS_FATAL ANY)
