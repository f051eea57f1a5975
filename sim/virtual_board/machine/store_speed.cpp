// Unicorn 2.0 asks at every store whether it overwrites translated code, with a heap allocation each time: half of all its time.
// Here code lies in flash alone and RAM is not executable, so the answer is always no. The library calls these functions of its
// own by name, and finds ours first; where a version of it does not, nothing but speed changes.
#include "sim/virtual_board/machine/store_speed.hpp"

struct page_collection;
struct uc_struct;

extern "C" {
page_collection* page_collection_lock_arm(uc_struct*, unsigned long, unsigned long);  // NOLINT: the library's names
void page_collection_unlock_arm(page_collection*);                                    // NOLINT
void tb_invalidate_phys_page_fast_arm(uc_struct*, page_collection*, unsigned long, int, unsigned long);  // NOLINT

page_collection* page_collection_lock_arm(uc_struct*, unsigned long, unsigned long) { return nullptr; }
void page_collection_unlock_arm(page_collection*) {}
void tb_invalidate_phys_page_fast_arm(uc_struct*, page_collection*, unsigned long, int, unsigned long) {}
}

namespace tricoil::virtual_board {

void use_fast_stores() {}

}  // namespace tricoil::virtual_board
