# tricoil_image(NAME LINKER_SCRIPT FILE.in SOURCES ... [DEPENDS ...])
# Image of a board without an operating system: NAME.elf, NAME.bin and NAME.hex. FILE.in is the template of the linker script. The build
# fills in the CRC of an image header (toolchain/image-seal) and prints the SHA-256 of NAME.bin. Only the archives of the C library and the compiler are linked: without the C++ library and _sbrk, code
# that allocates does not link.
set(TRICOIL_STACK_BYTES 6144 CACHE STRING "Stack of the image; the budget is smaller")

function(tricoil_image name)
  cmake_parse_arguments(ARG "" "LINKER_SCRIPT" "SOURCES;DEPENDS" ${ARGN})
  configure_file(${ARG_LINKER_SCRIPT} ${CMAKE_CURRENT_BINARY_DIR}/link.ld @ONLY)
  add_executable(${name} ${ARG_SOURCES})
  set_target_properties(${name} PROPERTIES SUFFIX .elf
    LINK_DEPENDS "${CMAKE_CURRENT_BINARY_DIR}/link.ld;${PROJECT_SOURCE_DIR}/board/cortex_m/sections.ld;${PROJECT_SOURCE_DIR}/toolchain/image-seal")
  target_link_libraries(${name} PRIVATE ${ARG_DEPENDS} tricoil_cortex_m tricoil_options)
  target_link_options(${name} PRIVATE -nostartfiles -nodefaultlibs -Wl,--gc-sections -Wl,-Map=${CMAKE_CURRENT_BINARY_DIR}/${name}.map
    -L ${PROJECT_SOURCE_DIR}/board/cortex_m -T ${CMAKE_CURRENT_BINARY_DIR}/link.ld)

  find_package(Python3 REQUIRED COMPONENTS Interpreter)
  find_program(TRICOIL_OBJCOPY arm-none-eabi-objcopy REQUIRED)
  add_custom_command(TARGET ${name} POST_BUILD
    COMMAND ${Python3_EXECUTABLE} ${PROJECT_SOURCE_DIR}/toolchain/image-seal $<TARGET_FILE:${name}>
    COMMAND ${TRICOIL_OBJCOPY} -O binary $<TARGET_FILE:${name}> ${name}.bin
    COMMAND ${TRICOIL_OBJCOPY} -O ihex $<TARGET_FILE:${name}> ${name}.hex
    COMMAND ${CMAKE_COMMAND} -E sha256sum ${name}.bin
    BYPRODUCTS ${name}.bin ${name}.hex
    COMMENT "${name}.bin, ${name}.hex, SHA-256:" VERBATIM)
endfunction()
