// Memory set aside for a shortage.
#pragma once

namespace tricoil::host {

/// Sets memory aside. It is released when an allocation fails for the first time. That allocation is repeated, so that the
/// program can finish or clean up: some libraries allocate where they cannot report a failure. Later failures throw
/// std::bad_alloc. Call it once, at the start of main().
void set_memory_aside();

}  // namespace tricoil::host
