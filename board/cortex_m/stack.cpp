#include "board/cortex_m/stack.hpp"

#include <algorithm>
#include <cstdint>

extern "C" {
// NOLINTNEXTLINE(readability-identifier-naming): names of the linker script
extern std::uint32_t stack_bottom[], stack_top[];
}

namespace tricoil::board {
namespace {

constexpr std::uint32_t kPaint = 0x5AFE57ACU;
constexpr std::size_t kOwnFrameWords = 32;  // words below this frame's address that are in use and not painted
constexpr std::size_t kMinFreeBytes = 64;   // with fewer unwritten bytes the stack counts as full

}  // namespace

// Not inlined, so that its frame is below the caller's frame.
[[gnu::noinline]] void paint_stack() {
    auto* const here = static_cast<std::uint32_t*>(__builtin_frame_address(0));
    for (volatile std::uint32_t* word = stack_bottom; word < here - kOwnFrameWords; ++word) {
        *word = kPaint;  // volatile prevents a call to memset, whose frame would be in the painted area
    }
}

std::size_t used_stack_bytes() {
    const std::uint32_t* word = stack_bottom;
    while (word != stack_top && *word == kPaint) {
        ++word;
    }
    return static_cast<std::size_t>(stack_top - word) * sizeof(std::uint32_t);
}

bool stack_was_full() {
    const std::uint32_t* const end = stack_bottom + kMinFreeBytes / sizeof(std::uint32_t);
    return std::any_of(static_cast<const std::uint32_t*>(stack_bottom), end, [](std::uint32_t word) { return word != kPaint; });
}

}  // namespace tricoil::board
