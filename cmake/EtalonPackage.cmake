# The Debian package, made by scripts/package.sh: `cpack` in the build folder. It holds program, libraries, plugins, headers,
# configuration, documents, man pages and completion for bash; what programs need comes with it, what a plugin is compiled
# against is suggested.
install(FILES "${CMAKE_SOURCE_DIR}/CHANGELOG.md" DESTINATION ${CMAKE_INSTALL_DOCDIR})
install(FILES "${CMAKE_SOURCE_DIR}/packaging/etalon.bash-completion"
        DESTINATION ${CMAKE_INSTALL_DATADIR}/bash-completion/completions RENAME etalon)

# Man pages from --help: the program's, and one for each command.
find_program(HELP2MAN help2man)
if(HELP2MAN)
  add_custom_target(
    man
    COMMAND "${CMAKE_SOURCE_DIR}/packaging/man_pages.sh" "${HELP2MAN}" $<TARGET_FILE:etalon> "${CMAKE_BINARY_DIR}/man"
    VERBATIM)
  install(DIRECTORY "${CMAKE_BINARY_DIR}/man/" DESTINATION ${CMAKE_INSTALL_MANDIR}/man1 OPTIONAL)
endif()

set(CPACK_GENERATOR DEB)
set(CPACK_PACKAGE_NAME etalon)
set(CPACK_PACKAGE_CONTACT "The Etalon developers <etalon@localhost>")
set(CPACK_PACKAGING_INSTALL_PREFIX /usr)
set(CPACK_STRIP_FILES ON)
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_PACKAGE_SECTION science)
set(CPACK_DEBIAN_PACKAGE_DESCRIPTION "${PROJECT_DESCRIPTION}")
set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS ON)
set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS_PRIVATE_DIRS "${CMAKE_BINARY_DIR}/lib")
set(CPACK_DEBIAN_PACKAGE_SUGGESTS
    "cmake, g++, libmrpt-obs-dev, libmrpt-gui-dev, libopencv-dev, libceres-dev, libexpected-dev, libyaml-cpp-dev, nlohmann-json3-dev, libxxhash-dev, libboost-dev"
)
include(CPack)
