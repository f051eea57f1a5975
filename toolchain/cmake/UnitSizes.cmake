# Targets whose files need much memory to compile: with TRICOIL_SMALL_MEMORY, fewer files in a unit than CMake's 8.
set(TRICOIL_FILES_IN_A_UNIT
  tricoil_calibration 4 tricoil_run 5 tricoil_serve_commands 5 tricoil_sim 5 tricoil_tools 3
  tricoil-front-end 2 tricoil-virtual-board 1 tricoil_python 3
  cli 5 metal 3 serve 5 tracking_quick 3 virtual_board_image 4)
while(TRICOIL_FILES_IN_A_UNIT)
  list(POP_FRONT TRICOIL_FILES_IN_A_UNIT target files)
  if(TARGET ${target})
    set_target_properties(${target} PROPERTIES UNITY_BUILD_BATCH_SIZE ${files})
  endif()
endwhile()
