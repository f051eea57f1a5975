// Counts heap allocations.
#pragma once

#include <cstddef>

namespace tricoil::test {

/// Counts calls of operator new, malloc and related functions in this thread during its lifetime.
class AllocationTrap {
public:
    AllocationTrap();
    ~AllocationTrap();
    AllocationTrap(const AllocationTrap&) = delete;
    AllocationTrap& operator=(const AllocationTrap&) = delete;
    [[nodiscard]] std::size_t count() const;
};

}  // namespace tricoil::test
