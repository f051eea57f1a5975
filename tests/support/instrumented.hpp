// Time limits of programs that a sanitizer makes slower.
#pragma once

namespace tricoil::test {

/// Factor of time limits in this build.
#if defined(__SANITIZE_THREAD__) || defined(__SANITIZE_ADDRESS__)
constexpr int kSlowdown = 5;
#else
constexpr int kSlowdown = 1;
#endif

}  // namespace tricoil::test
