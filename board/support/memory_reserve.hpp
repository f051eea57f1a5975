// Memory set aside for a shortage.
#pragma once

namespace tricoil::host {

/// Sets memory aside. It is given back at the first allocation that fails, which is then tried again, so that the program can
/// finish or clean up: some libraries allocate where they cannot report a failure. When it is spent, allocations throw
/// std::bad_alloc. Call it once, at the start of main().
void set_memory_aside();

}  // namespace tricoil::host
