// Mailbox at the start of RAM: job from the test, results from the image.
#pragma once

#include <cstdint>

namespace tricoil::test {

constexpr std::uint32_t kMailbox = 0x20000000;
constexpr std::uint32_t kResults = 64;

/// Job that the image runs.
enum class Job : std::uint32_t {
    nothing,
    count_instructions,
    nest_interrupts,
    tail_chain,
    late_arrival,
    mask_by_basepri,
    mask_by_primask,
    lazy_float,
    process_stack,
    system_call,
    sys_tick_sleep,
    reset_itself,
    cycle_counter,
    read_nowhere,
    write_flash,
    undefined,
    jump_nowhere,
    float_while_off,
    unclocked,
    no_handler,
    stack_overflow,
    hang,
    bootloader,
    hints,
    sleep_on_exit,
    bus_fault,
    usage_fault,
};

struct Mailbox {
    Job job;
    std::uint32_t done;  // 1 when the job is done
    std::uint32_t boots;
    std::uint32_t count;  // number of entries in results
    std::uint32_t results[kResults];
};

}  // namespace tricoil::test
