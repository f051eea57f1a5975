# Precompiled headers of libraries that most hosted units include: one set for programs, one with GoogleTest for tests.
# Presets that check includes (host-debug, host-clang) leave TRICOIL_PRECOMPILE off.
option(TRICOIL_PRECOMPILE "Precompile the headers of libraries" OFF)

set(TRICOIL_HOSTED_HEADERS <Eigen/Dense> <algorithm> <array> <chrono> <cmath> <cstdint> <filesystem> <fmt/format.h> <fstream> <functional>
  <map> <memory> <mutex> <nlohmann/json.hpp> <numbers> <optional> <random> <span> <sstream> <string> <thread> <vector>)

# tricoil_precompile(NAME LIBRARIES ... HEADERS ...): declares a library NAME; tricoil_use_precompiled() reuses its headers.
function(tricoil_precompile name)
  cmake_parse_arguments(ARG "" "" "LIBRARIES;HEADERS" ${ARGN})
  if(TRICOIL_PRECOMPILE AND NOT TARGET ${name})
    file(CONFIGURE OUTPUT ${CMAKE_BINARY_DIR}/${name}.cpp CONTENT "")  # not written again, which would compile it again
    add_library(${name} STATIC ${CMAKE_BINARY_DIR}/${name}.cpp)
    target_compile_features(${name} PRIVATE cxx_std_20)
    target_link_libraries(${name} PRIVATE ${ARG_LIBRARIES} tricoil_options)
    set_property(TARGET ${name} PROPERTY TRICOIL_LIBRARIES ${ARG_LIBRARIES})
    target_precompile_headers(${name} PRIVATE ${ARG_HEADERS})
  endif()
endfunction()

# A unit must be compiled with the same macros as the headers, hence with the same libraries.
function(tricoil_use_precompiled target headers)
  if(TARGET ${headers})
    get_target_property(libraries ${headers} TRICOIL_LIBRARIES)
    foreach(library ${libraries})
      target_link_libraries(${target} PRIVATE $<BUILD_INTERFACE:${library}>)
    endforeach()
    target_precompile_headers(${target} REUSE_FROM ${headers})
  endif()
endfunction()
