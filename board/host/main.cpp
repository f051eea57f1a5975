// main() of the executables of the `tricoil` program: runs one command, prints errors as one line.
#include <atomic>
#include <cstdlib>
#include <filesystem>
#include <new>
#include <string>

#include "board/host/build_commit.hpp"
#include "board/host/commands/program.hpp"
#include "board/support/terminal_text.hpp"

namespace {

int run_to_the_end(int argc, char** argv) {
    tricoil::host::ignore_broken_pipe();
    tricoil::host::ProgramIdentity identity;
    identity.uses_defaults = true;
    if (!std::filesystem::path(argv[0]).filename().string().starts_with("tricoil-")) {  // another executable was started directly
        identity.typed_name = argv[0];
    }
    if (const std::string commit = tricoil::host::build_commit(); !commit.empty()) {
        identity.version += " (" + commit + ")";
    }
    const int code = tricoil::host::run_program({argv + 1, argv + argc}, tricoil::host::own_commands(), identity);
    tricoil::host::end_standard_output();
    return code;
}

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

/// Sets memory aside. It is released when an allocation fails for the first time. That allocation is repeated, so that the
/// program can finish or clean up: some libraries allocate where they cannot report a failure. Later failures throw
/// std::bad_alloc. Call it once, at the start of main().
void set_memory_aside() {
    reserve = std::malloc(kReserveBytes);  // NOLINT(cppcoreguidelines-no-malloc)
    std::set_new_handler(give_back);
}

}  // namespace

int main(int argc, char** argv) {
    set_memory_aside();
    return tricoil::host::exit_code_of("tricoil", [&] { return run_to_the_end(argc, argv); });
}
