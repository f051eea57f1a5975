# Compiler settings that every target shares, and the one function that declares a library of the tree.
get_filename_component(TRICOIL_TREE ${CMAKE_CURRENT_LIST_DIR}/../.. ABSOLUTE)
set(CMAKE_CXX_STANDARD 20)
set(CMAKE_CXX_STANDARD_REQUIRED ON)
set(CMAKE_CXX_EXTENSIONS OFF)
set(CMAKE_EXPORT_COMPILE_COMMANDS ON)
if(NOT CMAKE_BUILD_TYPE)
  set(CMAKE_BUILD_TYPE Release)
endif()

find_program(TRICOIL_CCACHE ccache)
if(TRICOIL_CCACHE AND NOT CMAKE_CXX_COMPILER_LAUNCHER)
  set(CMAKE_CXX_COMPILER_LAUNCHER ${TRICOIL_CCACHE})
endif()

add_library(tricoil_options INTERFACE)
target_compile_options(tricoil_options INTERFACE -Wall -Wextra -Wpedantic -Wshadow -Wdouble-promotion -Wconversion -Wno-sign-conversion)
target_compile_options(tricoil_options INTERFACE $<$<CXX_COMPILER_ID:GNU>:-Wno-psabi>)
if(TRICOIL_SANITIZE)
  target_compile_options(tricoil_options INTERFACE -fsanitize=address,undefined -fno-sanitize-recover=all -fno-omit-frame-pointer)
  target_link_options(tricoil_options INTERFACE -fsanitize=address,undefined)
endif()

# tricoil_library(NAME [FREESTANDING] SOURCES ... DEPENDS ...)
# FREESTANDING: must also build for a board without an operating system, hence without exceptions and run-time types.
function(tricoil_library name)
  cmake_parse_arguments(ARG "FREESTANDING" "" "SOURCES;DEPENDS" ${ARGN})
  add_library(${name} STATIC ${ARG_SOURCES})
  target_compile_features(${name} PUBLIC cxx_std_20)
  # Installed headers: <tricoil/core/...>, and "core/..." as they include each other.
  target_include_directories(${name} PUBLIC $<BUILD_INTERFACE:${TRICOIL_TREE}>
    $<INSTALL_INTERFACE:include> $<INSTALL_INTERFACE:include/tricoil>)
  target_link_libraries(${name} PUBLIC ${ARG_DEPENDS} PRIVATE $<BUILD_INTERFACE:tricoil_options>)
  if(ARG_FREESTANDING)
    target_compile_options(${name} PRIVATE -fno-exceptions -fno-rtti)
  endif()
endfunction()
