// A QEMU plugin (TCG plugin API version 1) that counts the instructions executed by the emulated processor from the first
// instruction of one function to the first instruction of another. The count is exact and equal in every run.
//   -plugin libinstruction_count.so,begin=ADDRESS,end=ADDRESS,out=FILE
// One line per pair is written to FILE.
#include <cinttypes>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>

// Debian ships no qemu-plugin.h. These are the declarations in use, as documented for QEMU 7.2 (docs/devel/tcg-plugins).
extern "C" {
// NOLINTBEGIN(readability-identifier-naming): QEMU's names
struct qemu_plugin_tb;
struct qemu_plugin_insn;
struct qemu_info_t;
using qemu_plugin_id_t = std::uint64_t;
enum qemu_plugin_op { QEMU_PLUGIN_INLINE_ADD_U64 };
enum qemu_plugin_cb_flags { QEMU_PLUGIN_CB_NO_REGS };
using translation_callback = void (*)(qemu_plugin_id_t, qemu_plugin_tb*);
using execution_callback = void (*)(unsigned, void*);
using exit_callback = void (*)(qemu_plugin_id_t, void*);
void qemu_plugin_register_vcpu_tb_trans_cb(qemu_plugin_id_t, translation_callback);
void qemu_plugin_register_vcpu_insn_exec_cb(qemu_plugin_insn*, execution_callback, qemu_plugin_cb_flags, void*);
void qemu_plugin_register_vcpu_insn_exec_inline(qemu_plugin_insn*, qemu_plugin_op, void*, std::uint64_t);
void qemu_plugin_register_atexit_cb(qemu_plugin_id_t, exit_callback, void*);
std::size_t qemu_plugin_tb_n_insns(const qemu_plugin_tb*);
qemu_plugin_insn* qemu_plugin_tb_get_insn(const qemu_plugin_tb*, std::size_t);
std::uint64_t qemu_plugin_insn_vaddr(const qemu_plugin_insn*);
[[gnu::visibility("default")]] int qemu_plugin_version = 1;
// NOLINTEND(readability-identifier-naming)
}

namespace {

std::uint64_t executed = 0;  // one processor only: no lock
std::uint64_t executed_at_begin = 0;
std::uint64_t begin_address = 0;
std::uint64_t end_address = 0;
std::FILE* out = nullptr;

void at_begin(unsigned, void*) { executed_at_begin = executed; }
void at_end(unsigned, void*) { std::fprintf(out, "%" PRIu64 "\n", executed - executed_at_begin); }

void translate(qemu_plugin_id_t, qemu_plugin_tb* block) {
    for (std::size_t n = 0; n < qemu_plugin_tb_n_insns(block); ++n) {
        qemu_plugin_insn* instruction = qemu_plugin_tb_get_insn(block, n);
        const std::uint64_t address = qemu_plugin_insn_vaddr(instruction);
        if (address == begin_address) {
            qemu_plugin_register_vcpu_insn_exec_cb(instruction, at_begin, QEMU_PLUGIN_CB_NO_REGS, nullptr);
        } else if (address == end_address) {
            qemu_plugin_register_vcpu_insn_exec_cb(instruction, at_end, QEMU_PLUGIN_CB_NO_REGS, nullptr);
        }
        qemu_plugin_register_vcpu_insn_exec_inline(instruction, QEMU_PLUGIN_INLINE_ADD_U64, &executed, 1);
    }
}

void finish(qemu_plugin_id_t, void*) { std::fclose(out); }

}  // namespace

extern "C" [[gnu::visibility("default")]] int qemu_plugin_install(qemu_plugin_id_t id, const qemu_info_t*, int argc,
                                                                  char** argv) {
    for (int n = 0; n < argc; ++n) {
        const char* value = std::strchr(argv[n], '=');
        if (value == nullptr) {
            return -1;
        }
        ++value;
        if (std::strncmp(argv[n], "begin=", 6) == 0) {
            begin_address = std::strtoull(value, nullptr, 16) & ~1ULL;  // bit 0 is the Thumb bit
        } else if (std::strncmp(argv[n], "end=", 4) == 0) {
            end_address = std::strtoull(value, nullptr, 16) & ~1ULL;
        } else if (std::strncmp(argv[n], "out=", 4) == 0) {
            out = std::fopen(value, "w");
        }
    }
    if (begin_address == 0 || end_address == 0 || out == nullptr) {
        std::fputs("instruction_count: needs begin=, end= and a writable out=\n", stderr);
        return -1;
    }
    qemu_plugin_register_vcpu_tb_trans_cb(id, translate);
    qemu_plugin_register_atexit_cb(id, finish, nullptr);
    return 0;
}
