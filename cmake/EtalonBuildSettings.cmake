# Settings shared by every target: language, warnings, output folders, compiler cache.
# Host and plugins must be compiled alike (Eigen's alignment is part of the binary interface), so nothing here depends
# on the machine: baseline x86-64, no -march=native.

set(CMAKE_CXX_STANDARD 17)
set(CMAKE_CXX_STANDARD_REQUIRED ON)
set(CMAKE_CXX_EXTENSIONS OFF)
set(CMAKE_POSITION_INDEPENDENT_CODE ON)
set(CMAKE_EXPORT_COMPILE_COMMANDS ON)

if(NOT CMAKE_BUILD_TYPE AND NOT CMAKE_CONFIGURATION_TYPES)
  set(CMAKE_BUILD_TYPE Release CACHE STRING "Build type" FORCE)
endif()

set(CMAKE_RUNTIME_OUTPUT_DIRECTORY "${CMAKE_BINARY_DIR}/bin")
set(CMAKE_LIBRARY_OUTPUT_DIRECTORY "${CMAKE_BINARY_DIR}/lib")
set(CMAKE_ARCHIVE_OUTPUT_DIRECTORY "${CMAKE_BINARY_DIR}/lib")

# The installed tree can be moved: libraries and plugins are found relative to the file that needs them.
set(CMAKE_INSTALL_RPATH "$ORIGIN/../${CMAKE_INSTALL_LIBDIR}" "$ORIGIN" "$ORIGIN/../..")

find_program(ETALON_CCACHE ccache)
if(ETALON_CCACHE AND NOT CMAKE_CXX_COMPILER_LAUNCHER)
  # It may trust precompiled headers, which it takes for their sources otherwise.
  set(CMAKE_CXX_COMPILER_LAUNCHER "${CMAKE_COMMAND}" -E env CCACHE_SLOPPINESS=pch_defines,time_macros "${ETALON_CCACHE}")
endif()

option(ETALON_SANITIZE "Address and undefined-behaviour sanitizers" OFF)
option(ETALON_WARNINGS_AS_ERRORS "Treat compiler warnings as errors" OFF)

add_library(etalon_build_settings INTERFACE)
target_compile_options(etalon_build_settings INTERFACE -Wall -Wextra -Wpedantic -Wshadow)
# Nobody replaces a function of a library from outside, nobody reads errno after a square root: both can be inlined.
target_compile_options(etalon_build_settings INTERFACE -fno-semantic-interposition -fno-math-errno)
# Eigen's templates fill a gigabyte of GCC's memory, which it goes through again and again for garbage unless told not to: a tenth to
# a fifth of the time to compile, for a fifth more memory.
if(CMAKE_CXX_COMPILER_ID STREQUAL "GNU")
  target_compile_options(etalon_build_settings INTERFACE "SHELL:--param ggc-min-heapsize=2000000") # KiB
endif()
if(ETALON_WARNINGS_AS_ERRORS)
  target_compile_options(etalon_build_settings INTERFACE -Werror)
endif()
# The checks of the standard library (indices, empty containers) wherever assert() is on; they change no layout.
add_compile_definitions($<$<CONFIG:Debug>:_GLIBCXX_ASSERTIONS>)
if(ETALON_SANITIZE)
  # Eigen's assertions, too; without NDEBUG, at a level of optimisation and of debug information that builds quickly.
  set(CMAKE_CXX_FLAGS_RELWITHDEBINFO "-O1 -g1")
  add_compile_definitions(_GLIBCXX_ASSERTIONS)
  # Eigen's inline allocation is exported by MRPT's libraries, too, which know no sanitizers: memory that one of them allocates
  # and the other frees must come from malloc in both.
  add_compile_definitions(EIGEN_MALLOC_ALREADY_ALIGNED=1)
  # float-cast-overflow: a number too large for the integer that it becomes; not among `undefined`.
  add_compile_options(-fsanitize=address,undefined,float-cast-overflow -fno-omit-frame-pointer -fno-sanitize-recover=all)
  add_link_options(-fsanitize=address,undefined)
endif()

# etalon_optimize_little(TARGET)
# For a program whose own time to run does not count: compiles a quarter faster, runs 4 % slower.
function(etalon_optimize_little target)
  target_compile_options(${target} PRIVATE $<$<CONFIG:Release>:-O1>)
endfunction()
