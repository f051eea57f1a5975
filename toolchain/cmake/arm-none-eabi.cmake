# Debian's arm-none-eabi-gcc for processors without an operating system. Included by one file per processor, which sets TRICOIL_CPU_FLAGS.
set(CMAKE_SYSTEM_NAME Generic)
set(CMAKE_SYSTEM_PROCESSOR arm)
set(CMAKE_CXX_COMPILER arm-none-eabi-g++)
set(CMAKE_TRY_COMPILE_TARGET_TYPE STATIC_LIBRARY)  # a test program would need the start-up code

# No exceptions, no run-time type information, no unwind tables; static objects are constructed before main, in one thread.
# -fstack-usage writes each function's stack frame beside its object file, for the worst case over the call graph.
# File names in messages do not contain the folder of the tree, so an image does not depend on it.
get_filename_component(TRICOIL_IMAGE_TREE ${CMAKE_CURRENT_LIST_DIR}/../.. ABSOLUTE)
string(CONCAT TRICOIL_TARGET_FLAGS
  "${TRICOIL_CPU_FLAGS} --specs=nano.specs -ffunction-sections -fdata-sections -fno-exceptions -fno-rtti "
  "-fno-unwind-tables -fno-asynchronous-unwind-tables -fno-threadsafe-statics -fno-math-errno -fstack-usage "
  "-fmacro-prefix-map=${TRICOIL_IMAGE_TREE}/=")
set(CMAKE_CXX_FLAGS_INIT "${TRICOIL_TARGET_FLAGS}")
set(CMAKE_CXX_FLAGS_RELEASE_INIT "-O2 -DNDEBUG")
set(CMAKE_CXX_FLAGS_RELEASE "-O2 -DNDEBUG" CACHE STRING "The budgets were measured with these flags")

set(CMAKE_FIND_ROOT_PATH_MODE_PROGRAM NEVER)

# The only libraries linked: the small C library, its mathematics, the compiler's helpers. Last on the command line.
set(CMAKE_CXX_STANDARD_LIBRARIES "-Wl,--start-group -lm -lc_nano -lgcc -Wl,--end-group")
