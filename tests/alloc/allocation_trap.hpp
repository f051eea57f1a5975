// Counts every use of the heap while armed.
#pragma once

#include <cstddef>

namespace tricoil::test {

/// While it lives, operator new and malloc (and their kin) are counted in this thread.
class AllocationTrap {
public:
    AllocationTrap();
    ~AllocationTrap();
    AllocationTrap(const AllocationTrap&) = delete;
    AllocationTrap& operator=(const AllocationTrap&) = delete;
    [[nodiscard]] std::size_t count() const;
};

}  // namespace tricoil::test
