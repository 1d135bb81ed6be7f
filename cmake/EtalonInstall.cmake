# Installs libraries, headers, documentation and the package etalon: find_package(etalon) gives the targets etalon::<module> and the
# function etalon_add_initializer(); etalon::contract is the test library for plugins. The installed tree can be moved.
include(CMakePackageConfigHelpers)

set(package_folder "${CMAKE_INSTALL_LIBDIR}/cmake/etalon")
get_property(module_targets GLOBAL PROPERTY ETALON_MODULE_TARGETS)
get_property(module_include_folders GLOBAL PROPERTY ETALON_MODULE_INCLUDE_DIRS)

install(
  TARGETS ${module_targets}
  EXPORT etalonTargets
  LIBRARY DESTINATION ${CMAKE_INSTALL_LIBDIR})
foreach(folder IN LISTS module_include_folders)
  install(DIRECTORY "${folder}" DESTINATION ${CMAKE_INSTALL_INCLUDEDIR} FILES_MATCHING PATTERN "*.h")
endforeach()
install(DIRECTORY "${CMAKE_SOURCE_DIR}/config/" DESTINATION ${CMAKE_INSTALL_DATADIR}/etalon/config)


# The documentation, laid out as in the source tree so that its links hold.
install(FILES "${CMAKE_SOURCE_DIR}/README.md" "${CMAKE_SOURCE_DIR}/LICENSE" DESTINATION ${CMAKE_INSTALL_DOCDIR})
install(DIRECTORY "${CMAKE_SOURCE_DIR}/docs" "${CMAKE_SOURCE_DIR}/examples" "${CMAKE_SOURCE_DIR}/config"
        DESTINATION ${CMAKE_INSTALL_DOCDIR} PATTERN "build" EXCLUDE)
install(DIRECTORY "${CMAKE_SOURCE_DIR}/plugins" DESTINATION ${CMAKE_INSTALL_DOCDIR} FILES_MATCHING PATTERN "README.md")

install(EXPORT etalonTargets NAMESPACE etalon:: DESTINATION ${package_folder})
configure_package_config_file("${CMAKE_CURRENT_LIST_DIR}/etalonConfig.cmake.in" "${CMAKE_BINARY_DIR}/etalonConfig.cmake"
                              INSTALL_DESTINATION ${package_folder} PATH_VARS CMAKE_INSTALL_BINDIR)
# Before 1.0 a minor version may change the interface.
write_basic_package_version_file("${CMAKE_BINARY_DIR}/etalonConfigVersion.cmake" COMPATIBILITY SameMinorVersion)
install(FILES "${CMAKE_BINARY_DIR}/etalonConfig.cmake" "${CMAKE_BINARY_DIR}/etalonConfigVersion.cmake"
              "${CMAKE_CURRENT_LIST_DIR}/EtalonAddInitializer.cmake" DESTINATION ${package_folder})
