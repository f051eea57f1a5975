// A heap whose fresh memory holds a pattern: what a program sends of it uninitialized can be seen.
#pragma once

namespace tricoil::test {

/// pattern: the byte that memory from operator new holds from now on; -1: whatever was there.
void poison_fresh_memory(int pattern);

}  // namespace tricoil::test
