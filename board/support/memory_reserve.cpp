#include "board/support/memory_reserve.hpp"

#include <atomic>
#include <cstdlib>
#include <new>

namespace tricoil::host {
namespace {

constexpr std::size_t kReserveBytes = std::size_t{1} << 20U;

// The handler has no parameter, so its state is global.
std::atomic<void*> reserve = nullptr;  // NOLINT(cppcoreguidelines-avoid-non-const-global-variables)

void give_back() {
    void* const memory = reserve.exchange(nullptr);
    if (memory == nullptr) {
        throw std::bad_alloc();
    }
    std::free(memory);  // NOLINT(cppcoreguidelines-no-malloc): new would call this handler
}

}  // namespace

void set_memory_aside() {
    reserve = std::malloc(kReserveBytes);  // NOLINT(cppcoreguidelines-no-malloc)
    std::set_new_handler(give_back);
}

}  // namespace tricoil::host
