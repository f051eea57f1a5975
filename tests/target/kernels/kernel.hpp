// Kernel: a part of the core whose instructions are counted and whose stack is measured on an emulated processor.
#pragma once

#include <span>

namespace tricoil::target {

struct Kernel {
    const char* name;          // the key in toolchain/budgets.toml
    int runs;                  // with different inputs; the longest counts
    void (*prepare)(int run);  // not counted
    void (*run)(int run);
};

/// Every group of kernels; kernels_main runs them all.
std::span<const Kernel> float_kernels();
std::span<const Kernel> filter_kernels();
std::span<const Kernel> fixed_kernels();

}  // namespace tricoil::target
