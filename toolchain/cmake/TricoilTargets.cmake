# Compiler settings that all targets share, and tricoil_library(), which declares a library.
get_filename_component(TRICOIL_TREE ${CMAKE_CURRENT_LIST_DIR}/../.. ABSOLUTE)
set(CMAKE_CXX_STANDARD 20)
set(CMAKE_CXX_STANDARD_REQUIRED ON)
set(CMAKE_CXX_EXTENSIONS OFF)
set(CMAKE_EXPORT_COMPILE_COMMANDS ON)
if(NOT CMAKE_BUILD_TYPE)
  set(CMAKE_BUILD_TYPE Release)
endif()

# Compilers and linkers are started by toolchain/cmake/launch, which measures their processor time and memory (toolchain/build --costs).
# ccache is used if it is there at the first configuration: it costs a tenth of a build that finds nothing in the cache, and one that comes
# later would compile all again.
if(NOT DEFINED TRICOIL_CCACHE)
  find_program(TRICOIL_CCACHE ccache)
endif()
if(NOT CMAKE_CXX_COMPILER_LAUNCHER AND TRICOIL_CCACHE)
  set(CMAKE_CXX_COMPILER_LAUNCHER ${CMAKE_CURRENT_LIST_DIR}/launch ${TRICOIL_CCACHE})
elseif(NOT CMAKE_CXX_COMPILER_LAUNCHER)
  set(CMAKE_CXX_COMPILER_LAUNCHER ${CMAKE_CURRENT_LIST_DIR}/launch)
endif()
if(NOT CMAKE_CXX_LINKER_LAUNCHER)
  set(CMAKE_CXX_LINKER_LAUNCHER ${CMAKE_CURRENT_LIST_DIR}/launch)
endif()

# Host: code that runs once per command is compiled at -O1, which halves the compile time; libraries that run for each sample or column
# (FAST, FREESTANDING) at -O2. Images: see toolchain/cmake/arm-none-eabi.cmake.
if(NOT CMAKE_CROSSCOMPILING)
  string(REPLACE "-O3" "-O1" CMAKE_CXX_FLAGS_RELEASE "${CMAKE_CXX_FLAGS_RELEASE}")
endif()

# Host: every library can become part of a shared library. Symbols are hidden, so calls within a program cost nothing more; libraries and
# programs have the same flags, so that they share precompiled headers.
if(NOT CMAKE_CROSSCOMPILING)
  add_compile_options(-fPIC -fvisibility=hidden)
endif()

# No path of this machine in programs and libraries: assertions name files from the root of the sources. Debug information keeps the paths, for
# debuggers. ccache may make paths relative to the build folder.
if(NOT CMAKE_CROSSCOMPILING)
  add_compile_options("$<$<CONFIG:Release>:-ffile-prefix-map=${TRICOIL_TREE}/=;-ffile-prefix-map=../../=>")
endif()

# Installed and built programs have the same RPATH, if any: absolute folders of libraries outside of the system's. CMake pads the RPATH of a
# build that it changes at the installation with a colon, which makes the current folder part of it.
set(CMAKE_BUILD_WITH_INSTALL_RPATH ON)
set(CMAKE_INSTALL_RPATH_USE_LINK_PATH ON)

add_library(tricoil_options INTERFACE)
target_compile_options(tricoil_options INTERFACE -Wall -Wextra -Wpedantic -Wshadow -Wdouble-promotion -Wconversion -Wno-sign-conversion)
target_compile_options(tricoil_options INTERFACE $<$<CXX_COMPILER_ID:GNU>:-Wno-psabi>)
# GCC collects garbage rarely: less processor time, up to 1.1 GB of memory per compiler. With little memory (TRICOIL_SMALL_MEMORY) it
# collects often, and UnitSizes.cmake makes units smaller: 700 MB, a third more processor time. The programs are the same.
cmake_host_system_information(RESULT memory_mb QUERY TOTAL_PHYSICAL_MEMORY)
set(group_bytes max)
if(EXISTS /sys/fs/cgroup/memory.max)  # a container
  file(STRINGS /sys/fs/cgroup/memory.max group_bytes)
endif()
set(small_memory OFF)
if(memory_mb LESS 4000 OR (NOT group_bytes STREQUAL max AND group_bytes LESS 4194304000))
  set(small_memory ON)
endif()
option(TRICOIL_SMALL_MEMORY "Compile with at most 700 MB per compiler; ON by default below 4 GB of memory" ${small_memory})
set(collection --param=ggc-min-expand=200 --param=ggc-min-heapsize=600000)
if(TRICOIL_SMALL_MEMORY)
  set(collection --param=ggc-min-expand=20 --param=ggc-min-heapsize=380000)
endif()
target_compile_options(tricoil_options INTERFACE "$<$<CXX_COMPILER_ID:GNU>:${collection}>")
if(TRICOIL_SANITIZE)
  # Checks of null and alignment cost a third of the compile time. The address sanitizer reports null pointers too, and the fuzzers check
  # the alignment in all readers. Instrumented code makes GCC warn of uninitialised values in Eigen that are none.
  target_compile_options(tricoil_options INTERFACE
    -fsanitize=${TRICOIL_SANITIZE} -fno-sanitize=null,alignment -fno-sanitize-recover=all -fno-omit-frame-pointer
    -Wno-maybe-uninitialized)
  target_link_options(tricoil_options INTERFACE -fsanitize=${TRICOIL_SANITIZE})
  # Under the address sanitizer Eigen allocates in another way than in Debian's Ceres, and matrices cross that border.
  target_compile_definitions(tricoil_options INTERFACE EIGEN_MALLOC_ALREADY_ALIGNED=1)
endif()
# Programs are position independent by Debian's default of GCC and clang; tests/toolchain checks the result. Sanitizers do not work with
# _FORTIFY_SOURCE, and it needs optimisation.
if(TRICOIL_HARDEN AND NOT CMAKE_CROSSCOMPILING)
  include(CheckCXXCompilerFlag)
  add_compile_options(-fstack-protector-strong)
  add_link_options(LINKER:-z,relro,-z,now,-z,noexecstack)
  check_cxx_compiler_flag(-fcf-protection=full TRICOIL_HAS_CF_PROTECTION)
  if(TRICOIL_HAS_CF_PROTECTION)
    add_compile_options(-fcf-protection=full)
  endif()
  if(NOT TRICOIL_SANITIZE AND NOT TRICOIL_FUZZ)
    add_compile_options($<$<NOT:$<CONFIG:Debug>>:-U_FORTIFY_SOURCE> $<$<NOT:$<CONFIG:Debug>>:-D_FORTIFY_SOURCE=2>)
  endif()
endif()

include(${CMAKE_CURRENT_LIST_DIR}/PrecompiledHeaders.cmake)

# tricoil_library(NAME [FREESTANDING] [FAST] [COMPONENT NAME] SOURCES ... DEPENDS ... [COMPONENTS ...])
# COMPONENT: the library of an optional component; libraries that use it are compiled with TRICOIL_WITH_NAME.
# COMPONENTS: libraries of components, used if they are built. Their flags stay within this library, so that a component that is added later
# recompiles nothing else.
# FREESTANDING: must also build for boards without an operating system, so without exceptions and run-time type information.
# FAST: runs for each sample or column; compiled at -O2.
function(tricoil_library name)
  cmake_parse_arguments(ARG "FREESTANDING;FAST" "COMPONENT" "SOURCES;DEPENDS;COMPONENTS" ${ARGN})
  add_library(${name} STATIC ${ARG_SOURCES})
  target_compile_features(${name} PUBLIC cxx_std_20)
  # Installed headers: programs include <tricoil/core/...>; the headers include each other as "core/...".
  target_include_directories(${name} PUBLIC $<BUILD_INTERFACE:${TRICOIL_TREE}>
    $<INSTALL_INTERFACE:include> $<INSTALL_INTERFACE:include/tricoil>)
  # Installed headers need no Eigen, and it has no library.
  tricoil_headers_for(headers ${ARG_DEPENDS})
  list(TRANSFORM ARG_DEPENDS REPLACE "^Eigen3::Eigen$" "$<BUILD_INTERFACE:Eigen3::Eigen>")
  target_link_libraries(${name} PUBLIC ${ARG_DEPENDS} PRIVATE $<BUILD_INTERFACE:tricoil_options>)
  foreach(library ${ARG_COMPONENTS})
    if(TARGET ${library})
      target_link_libraries(${name} PRIVATE ${library})
    else()
      set_target_properties(${name} PROPERTIES TRICOIL_GROWS ON)  # a component that is added later compiles it again
    endif()
  endforeach()
  if(ARG_COMPONENT)
    target_compile_definitions(${name} INTERFACE TRICOIL_WITH_${ARG_COMPONENT})
  endif()
  if(ARG_FREESTANDING)
    # A hosted program that makes a tracker names the type information of its interface.
    target_compile_options(${name} PRIVATE -fno-exceptions $<$<BOOL:${CMAKE_CROSSCOMPILING}>:-fno-rtti>)
  endif()
  if(NOT ARG_FREESTANDING)
    tricoil_use_precompiled(${name} ${headers})
  endif()
  if((ARG_FREESTANDING OR ARG_FAST) AND NOT CMAKE_CROSSCOMPILING)
    target_compile_options(${name} PRIVATE $<$<CONFIG:Release>:-O2>)
    # From GCC 13, units at -O2 cannot use headers precompiled at -O1.
    if(CMAKE_CXX_COMPILER_ID STREQUAL "GNU" AND CMAKE_CXX_COMPILER_VERSION VERSION_GREATER_EQUAL 13)
      set_target_properties(${name} PROPERTIES DISABLE_PRECOMPILE_HEADERS ON)
    endif()
  endif()
endfunction()
