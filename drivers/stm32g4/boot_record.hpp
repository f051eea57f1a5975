// Memory that carries information across a reset: the boot request and the last program error.
#pragma once

#include <cstdint>
#include <initializer_list>
#include <type_traits>

namespace tricoil::stm32g4 {

/// Words in RAM that the start-up code does not clear. After power-on their content is undefined: a request is valid only with
/// the exact value of a constant, a program error only with its check word.
struct BootRecord {
    static constexpr std::uint32_t kEnterLoader = 0x10ADE2B0;
    static constexpr std::uint32_t kTryOtherBank = 0x7219'B4D6;
    static constexpr std::uint32_t kFreshStart = 0xF2E5'4A27;  // set before a reset whose only purpose is a clean start

    enum Ending : std::uint32_t { kNone, kFaulted, kAssertionFailed, kHung, kStackOverflow };

    /// Program error. A number that is zero is unknown.
    struct Error {
        std::uint32_t ending = kNone;
        std::uint32_t exception = 0;
        std::uint32_t pc = 0;  // of the faulty instruction, or of the instruction after the call of assertion_failed()
        std::uint32_t lr = 0;
        std::uint32_t cfsr = 0;     // ARMv7-M B3.2.15
        std::uint32_t address = 0;  // of the failed access
    };

    /// Stores the reason why this run ends. Uses little stack and no objects.
    void note(const Error& why) {
        count = (is_valid() ? count : 0) + 1;
        is_from_last_run = 1;
        ending = why.ending;
        exception = why.exception;
        pc = why.pc;
        lr = why.lr;
        cfsr = why.cfsr;
        address = why.address;
        check = sum();
    }

    /// True if the words are those that note() or forget() stored.
    [[nodiscard]] bool is_valid() const { return check == sum(); }

    /// True if the run before this one ended with an error. Call once at boot.
    bool take_last_run_failed() {
        const bool has_failed = is_valid() && is_from_last_run != 0;
        if (has_failed) {
            is_from_last_run = 0;
            check = sum();
        }
        return has_failed;
    }

    void forget() {
        note({});
        count = 0;
        is_from_last_run = 0;
        check = sum();
    }

    std::uint32_t request;           // one of the constants; any other value: none
    std::uint32_t is_from_last_run;  // 1: the last run ended with this error
    std::uint32_t count;             // errors since power-on
    std::uint32_t ending;
    std::uint32_t exception;
    std::uint32_t pc;
    std::uint32_t lr;
    std::uint32_t cfsr;
    std::uint32_t address;
    std::uint32_t check;

private:
    [[nodiscard]] std::uint32_t sum() const {
        std::uint32_t value = 0xC4A5'4ED0;
        for (const std::uint32_t word : {is_from_last_run, count, ending, exception, pc, lr, cfsr, address}) {
            value = (value << 5U | value >> 27U) ^ word;
        }
        return value;
    }
};

// Otherwise a constructor would clear the record at boot.
static_assert(std::is_trivially_default_constructible_v<BootRecord>);

}  // namespace tricoil::stm32g4
