# Targets whose files need much memory to compile: fewer files in a unit than CMake's 8, and fewer still with TRICOIL_SMALL_MEMORY.
# The Python module compiles last: in parts, two processors share it.
set(TRICOIL_FILES_IN_A_UNIT
  tricoil_calibration 4 tricoil_dense_algebra 1 tricoil_python 4 tricoil_tools 5 tricoil_web 3 metal 4 record 6 serve 4 tracking_quick 4
  virtual_board_image 5)
if(TRICOIL_SMALL_MEMORY)
  set(TRICOIL_FILES_IN_A_UNIT
    tricoil_calibration 2 tricoil_dense_algebra 1 tricoil_linux 5 tricoil_python 3 tricoil_record 5 tricoil_run 5 tricoil_sim 5
    tricoil_serve_commands 4 tricoil_tools 3 tricoil_web 4 tricoil-front-end 2 tricoil-virtual-board 1
    app 5 cli 5 device_test 5 metal 1 pty 5 record 4 serve 5 tracking_quick 2 unit_core 5 virtual_board_image 3)
endif()
while(TRICOIL_FILES_IN_A_UNIT)
  list(POP_FRONT TRICOIL_FILES_IN_A_UNIT target files)
  if(TARGET ${target})
    set_target_properties(${target} PROPERTIES UNITY_BUILD_BATCH_SIZE ${files})
  endif()
endwhile()
