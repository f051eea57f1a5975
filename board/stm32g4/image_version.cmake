# Writes OUT: version of the project and commit of the build, with a + if files differ from the commit.
execute_process(COMMAND git -C ${SOURCE_DIR} describe --always --abbrev=10 --dirty=+ --exclude=*
  OUTPUT_VARIABLE commit OUTPUT_STRIP_TRAILING_WHITESPACE ERROR_QUIET RESULT_VARIABLE failed)
if(failed)
  set(commit unknown)
endif()
string(REPLACE "." ";" parts ${VERSION})
list(GET parts 0 major)
list(GET parts 1 minor)
list(GET parts 2 patch)
file(CONFIGURE OUTPUT ${OUT} CONTENT [=[
// Made by the build.
#pragma once

#include <cstdint>

namespace tricoil::stm32g4_board {
constexpr std::uint32_t kFirmwareVersion = @major@U << 16U | @minor@U << 8U | @patch@U;
constexpr char kCommit[16] = "@commit@";
}  // namespace tricoil::stm32g4_board
]=] @ONLY)
