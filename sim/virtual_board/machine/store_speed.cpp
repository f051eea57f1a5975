// At every store Unicorn 2.0 checks for overwritten translated code. The check allocates heap memory and takes half of the run
// time. Cpu compares code in RAM with the translated code instead. The library calls its own functions
// through the dynamic linker, which finds the definitions of this file first. A version of the library that binds its functions
// internally is slower, with the same results.
#include "sim/virtual_board/machine/store_speed.hpp"

struct page_collection;
struct uc_struct;

#pragma GCC visibility push(default)  // the dynamic linker does not find hidden definitions
extern "C" {
page_collection* page_collection_lock_arm(uc_struct*, unsigned long, unsigned long);  // NOLINT: the library's names
void page_collection_unlock_arm(page_collection*);                                    // NOLINT
void tb_invalidate_phys_page_fast_arm(uc_struct*, page_collection*, unsigned long, int, unsigned long);  // NOLINT

page_collection* page_collection_lock_arm(uc_struct*, unsigned long, unsigned long) { return nullptr; }
void page_collection_unlock_arm(page_collection*) {}
void tb_invalidate_phys_page_fast_arm(uc_struct*, page_collection*, unsigned long, int, unsigned long) {}
}
#pragma GCC visibility pop

namespace tricoil::virtual_board {

void use_fast_stores() {}

}  // namespace tricoil::virtual_board
