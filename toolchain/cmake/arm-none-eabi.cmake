# Debian's arm-none-eabi-gcc for a part without an operating system. Included by one file per processor, which sets TRICOIL_CPU_FLAGS.
set(CMAKE_SYSTEM_NAME Generic)
set(CMAKE_SYSTEM_PROCESSOR arm)
set(CMAKE_CXX_COMPILER arm-none-eabi-g++)
set(CMAKE_TRY_COMPILE_TARGET_TYPE STATIC_LIBRARY)  # a program would need our startup code

# Nothing throws, nothing is looked up by type, no table of either is kept; statics are made before main, one thread only.
# -fstack-usage leaves each function's stack beside its object, for the worst case over the call graph.
string(CONCAT TRICOIL_TARGET_FLAGS
  "${TRICOIL_CPU_FLAGS} --specs=nano.specs -ffunction-sections -fdata-sections -fno-exceptions -fno-rtti "
  "-fno-unwind-tables -fno-asynchronous-unwind-tables -fno-threadsafe-statics -fno-math-errno -fstack-usage")
set(CMAKE_CXX_FLAGS_INIT "${TRICOIL_TARGET_FLAGS}")
set(CMAKE_CXX_FLAGS_RELEASE_INIT "-O2 -DNDEBUG")
set(CMAKE_CXX_FLAGS_RELEASE "-O2 -DNDEBUG" CACHE STRING "As small and fast as the budgets were measured")

# Eigen is header-only, so the host's copy serves; nothing else of the host is to be found.
set(CMAKE_PREFIX_PATH /usr)
set(CMAKE_FIND_ROOT_PATH_MODE_PROGRAM NEVER)

# All that is linked besides our own code: the small C library, its mathematics, the compiler's helpers. Last on the command line.
set(CMAKE_CXX_STANDARD_LIBRARIES "-Wl,--start-group -lm -lc_nano -lgcc -Wl,--end-group")
