# Images of boards with an STM32G4. Included by the CMakeLists.txt of a board's folder. The sources of this folder include pins.hpp and
# measuring.hpp from there.
include(TricoilImage)
set(TRICOIL_STM32G4_FOLDER ${CMAKE_CURRENT_LIST_DIR})

# tricoil_stm32g4_sources(NAME SOURCES ... [DEPENDS ...]): sources of this folder, built for the board.
function(tricoil_stm32g4_sources name)
  cmake_parse_arguments(ARG "" "" "SOURCES;DEPENDS" ${ARGN})
  list(TRANSFORM ARG_SOURCES PREPEND ${TRICOIL_STM32G4_FOLDER}/)
  add_library(${name} OBJECT ${ARG_SOURCES})
  target_include_directories(${name} PRIVATE ${CMAKE_CURRENT_SOURCE_DIR})
  target_link_libraries(${name} PRIVATE ${ARG_DEPENDS} tricoil_cortex_m tricoil_stm32g4 tricoil_options)
endfunction()

# tricoil_stm32g4_image(NAME FLASH_KIB N RAM_KIB N SOURCES ... [DEPENDS ...])
# An image with start-up code and safe fault handling. Its sources define the vectors and switch_outputs_off() (startup.hpp). BOOT_KIB: for
# a selector of the bank before the image.
function(tricoil_stm32g4_image name)
  cmake_parse_arguments(ARG "" "BOOT_KIB;FLASH_KIB;RAM_KIB" "SOURCES;DEPENDS" ${ARGN})
  set(boot_kib 0)
  set(boot_sections "")
  if(ARG_BOOT_KIB)
    set(boot_kib ${ARG_BOOT_KIB})
    file(READ ${TRICOIL_STM32G4_FOLDER}/boot_sections.ld boot_sections)
  endif()
  set(flash_kib ${ARG_FLASH_KIB})
  set(ram_kib ${ARG_RAM_KIB})
  tricoil_stm32g4_sources(${name}_startup SOURCES startup.cpp)
  tricoil_image(${name} LINKER_SCRIPT ${TRICOIL_STM32G4_FOLDER}/link.ld.in
    SOURCES ${ARG_SOURCES} $<TARGET_OBJECTS:${name}_startup>
    DEPENDS ${ARG_DEPENDS} tricoil_stm32g4)
endfunction()

# tricoil_stm32g4_tracker(NAME BOARD_NAME TEXT FLASH_KIB N RAM_KIB N PARTS ...)
# Firmware of a tracker board. PARTS: object libraries that define device_params() of measuring.hpp. BOARD_NAME: for the image header.
function(tricoil_stm32g4_tracker name)
  cmake_parse_arguments(ARG "" "BOARD_NAME;FLASH_KIB;RAM_KIB" "PARTS" ${ARGN})
  # Version and commit are determined with every build; the file is written only if they change.
  set(version_header ${CMAKE_CURRENT_BINARY_DIR}/version/image_version.hpp)
  add_custom_target(image_version BYPRODUCTS ${version_header}
    COMMAND ${CMAKE_COMMAND} -D SOURCE_DIR=${PROJECT_SOURCE_DIR} -D VERSION=${PROJECT_VERSION} -D OUT=${version_header}
      -P ${TRICOIL_STM32G4_FOLDER}/image_version.cmake
    VERBATIM)
  set(links tricoil_app tricoil_stm32g4_usart tricoil_stm32g4_fdcan tricoil_stm32g4_usb)
  tricoil_stm32g4_sources(${name}_parts DEPENDS ${links}
    SOURCES tracker_main.cpp tracker_board.cpp tracker_vectors.cpp image_header.cpp image_check.cpp image_bank.cpp
      bank_selector.cpp)
  add_dependencies(${name}_parts image_version)
  target_include_directories(${name}_parts PRIVATE ${CMAKE_CURRENT_BINARY_DIR}/version)
  target_compile_definitions(${name}_parts PRIVATE TRICOIL_BOARD_NAME="${ARG_BOARD_NAME}")
  tricoil_stm32g4_image(${name} BOOT_KIB 8 FLASH_KIB ${ARG_FLASH_KIB} RAM_KIB ${ARG_RAM_KIB}
    SOURCES $<TARGET_OBJECTS:${name}_parts>
    DEPENDS ${ARG_PARTS} ${links} tricoil_small_trigonometry)

  # Flash is scarce, so everything except loops over samples is built for size (toolchain/presets/targets.json).
endfunction()
