# STM32G4: Cortex-M4F. No fused multiply-add: products and sums are rounded separately, as on the host, so that
# both compute the same bits.
set(TRICOIL_CPU_FLAGS "-mcpu=cortex-m4 -mthumb -mfpu=fpv4-sp-d16 -mfloat-abi=hard -ffp-contract=off")
include(${CMAKE_CURRENT_LIST_DIR}/arm-none-eabi.cmake)
