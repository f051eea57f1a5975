// Fills new heap memory with a pattern, to detect uninitialised bytes in sent messages.
#pragma once

namespace tricoil::test {

/// pattern: value of all bytes of memory from operator new; -1: not filled.
void poison_fresh_memory(int pattern);

}  // namespace tricoil::test
