#include "sim/virtual_board/machine/cpu.hpp"

#include <fmt/format.h>
#include <unicorn/unicorn.h>

#include <algorithm>
#include <cstring>
#include <exception>
#include <utility>

#include "sim/virtual_board/machine/run_failure.hpp"
#include "sim/virtual_board/machine/store_speed.hpp"

namespace tricoil::virtual_board {
namespace {

constexpr std::uint16_t kWfi = 0xBF30;
constexpr std::uint16_t kWfe = 0xBF20;
constexpr std::uint16_t kYield = 0xBF10;

// Unicorn's numbers of exceptions of M-profile processors.
constexpr std::uint32_t kSupervisorCall = 2;
constexpr std::uint32_t kExceptionReturn = 8;

void check_unicorn(uc_err error, const char* what) {
    if (error != UC_ERR_OK) {
        throw std::runtime_error(fmt::format("unicorn: {}: {}", what, uc_strerror(error)));
    }
}

const char* reason_of(uc_mem_type type) {
    switch (type) {
        case UC_MEM_WRITE_PROT:
            return "which is flash or ROM";
        case UC_MEM_FETCH_PROT:
            return "which is RAM without code (MPU)";
        default:
            return "where there is no memory";
    }
}

const char* access_name(uc_mem_type type) {
    switch (type) {
        case UC_MEM_READ_UNMAPPED:
        case UC_MEM_READ_PROT:
            return "read from";
        case UC_MEM_WRITE_UNMAPPED:
        case UC_MEM_WRITE_PROT:
            return "write to";
        default:
            return "jump to";
    }
}

}  // namespace

template <typename Act>
void Cpu::guarded(Act act) {
    try {
        act();
    } catch (const std::exception& failure) {  // exceptions must not pass through generated code
        failure_ = failure_.value_or(failure.what());
        stopping_ = true;
        uc_emu_stop(uc_);
    }
}

struct Cpu::Hooks {
    static void block(uc_engine*, std::uint64_t address, std::uint32_t bytes, void* cpu) {
        auto& self = *static_cast<Cpu*>(cpu);
        self.guarded([&] { self.on_block(static_cast<std::uint32_t>(address), bytes); });
    }
    static void code(uc_engine*, std::uint64_t address, std::uint32_t bytes, void* cpu) {
        auto& self = *static_cast<Cpu*>(cpu);
        self.guarded([&] { self.check_division(static_cast<std::uint32_t>(address), bytes); });
    }
    static void data(uc_engine*, uc_mem_type, std::uint64_t address, int bytes, std::int64_t, void* cpu) {
        auto& self = *static_cast<Cpu*>(cpu);
        self.guarded([&] {
            fail_if(self.control_.traps_unaligned() && address % static_cast<unsigned>(bytes) != 0,
                    "unaligned access to {:#010x} with CCR.UNALIGN_TRP", address);
        });
    }
    static void interrupt(uc_engine*, std::uint32_t number, void* cpu) { static_cast<Cpu*>(cpu)->on_interrupt(number); }
    static bool forbidden(uc_engine*, uc_mem_type type, std::uint64_t address, int bytes, std::int64_t value, void* cpu) {
        const auto at = static_cast<std::uint32_t>(address);
        auto& self = *static_cast<Cpu*>(cpu);
        if (type == UC_MEM_WRITE_PROT && at - Memory::kFlashBase < Memory::kBankBytes && bytes == 4 &&
            self.store_to_flash(at, static_cast<std::uint32_t>(value))) {
            return true;
        }
        const bool fetches = type == UC_MEM_FETCH_UNMAPPED || type == UC_MEM_FETCH_PROT;
        if (type == UC_MEM_FETCH_PROT && Memory::is_ram(at) && !self.control_.mpu().forbids(at, true)) {
            return self.open_ram();
        }
        self.failure_ = fmt::format("{} {:#010x}, {}", access_name(type), at, reason_of(type));
        self.fault_ = Fault{fetches ? Fault::Kind::fetch : Fault::Kind::data, at};
        return false;
    }
    template <std::uint32_t kBase>
    static std::uint64_t read(uc_engine*, std::uint64_t offset, unsigned bytes, void* cpu) {
        auto& self = *static_cast<Cpu*>(cpu);
        std::uint32_t value = 0;
        self.guarded([&] { value = self.bus_.read(kBase + static_cast<std::uint32_t>(offset), bytes); });
        return value;
    }
    template <std::uint32_t kBase>
    static void write(uc_engine*, std::uint64_t offset, unsigned bytes, std::uint64_t value, void* cpu) {
        auto& self = *static_cast<Cpu*>(cpu);
        self.guarded(
            [&] { self.bus_.write(kBase + static_cast<std::uint32_t>(offset), static_cast<std::uint32_t>(value), bytes); });
    }
    template <std::uint32_t kBase, std::uint32_t kBytes>
    static void map(uc_engine* uc, Cpu* cpu) {
        check_unicorn(uc_mmio_map(uc, kBase, kBytes, &read<kBase>, cpu, &write<kBase>, cpu), "peripherals");
    }
};

Cpu::Cpu(Memory& memory, Bus& bus, Events& events, Nvic& nvic, SystemControl& control)
    : memory_(memory), bus_(bus), events_(events), nvic_(nvic), control_(control), flash_facts_(Memory::kBankBytes / 2) {
    use_fast_stores();
    check_unicorn(uc_open(UC_ARCH_ARM, static_cast<uc_mode>(UC_MODE_THUMB | UC_MODE_MCLASS), &uc_), "open");
    check_unicorn(uc_ctl_set_cpu_model(uc_, UC_CPU_ARM_CORTEX_M4), "Cortex-M4");
    const auto map = [this](std::uint32_t base, std::uint32_t bytes, std::uint32_t rights, std::uint8_t* host) {
        check_unicorn(uc_mem_map_ptr(uc_, base, bytes, rights, host), "memory");
    };
    constexpr std::uint32_t kFixed = UC_PROT_READ | UC_PROT_EXEC;
    constexpr std::uint32_t kData = UC_PROT_READ | UC_PROT_WRITE;  // not executable: see store_speed.cpp
    map(Memory::kFlashBase, Memory::kBankBytes, kFixed, memory.flash.data());
    map(0, Memory::kBankBytes, kFixed, memory.flash.data());
    map(Memory::kSystemBase, Memory::kSystemBytes, kFixed, memory.system.data());
    map(Memory::kRamBase, Memory::kRamBytes, kData, memory.ram.data());
    map(Memory::kCcmBase, Memory::kCcmBytes, kData, memory.ram.data() + Memory::kRamBytes - Memory::kCcmBytes);
    Hooks::map<Memory::kFlashBase + Memory::kBankBytes, Memory::kBankBytes>(uc_, this);
    Hooks::map<Memory::kRamBitsBase, 32 * Memory::kRamBytes>(uc_, this);
    Hooks::map<0x40000000, 0x10000000>(uc_, this);
    Hooks::map<0x50000000, 0x10000000>(uc_, this);
    Hooks::map<0xA0000000, 0x2000>(uc_, this);
    Hooks::map<0xE0000000, 0x00100000>(uc_, this);
    add_hook(UC_HOOK_BLOCK, reinterpret_cast<void*>(&Hooks::block));
    add_hook(UC_HOOK_INTR, reinterpret_cast<void*>(&Hooks::interrupt));
    add_hook(UC_HOOK_MEM_UNMAPPED | UC_HOOK_MEM_PROT, reinterpret_cast<void*>(&Hooks::forbidden));
}

Cpu::~Cpu() { uc_close(uc_); }

void Cpu::add_hook(int type, void* callback) {
    std::size_t hook = 0;
    check_unicorn(uc_hook_add(uc_, &hook, type, callback, this, 1, 0), "hook");
}

/// The hooks of the traps of CCR cost much time; they are added when a trap is switched on.
void Cpu::add_traps() {
    traps_ = true;
    add_hook(UC_HOOK_CODE, reinterpret_cast<void*>(&Hooks::code));
    add_hook(UC_HOOK_MEM_READ | UC_HOOK_MEM_WRITE, reinterpret_cast<void*>(&Hooks::data));
    forget_blocks_of_flash();  // they were translated without the hooks
}

void Cpu::map_data_pages() {
    for (const auto& [offset, bytes] : Memory::kDataPages) {
        check_unicorn(uc_mem_unmap(uc_, Memory::kFlashBase + offset, bytes), "data pages");
    }
    Hooks::map<Memory::kFlashBase + Memory::kDataPages[0].offset, Memory::kDataPages[0].bytes>(uc_, this);
    Hooks::map<Memory::kFlashBase + Memory::kDataPages[1].offset, Memory::kDataPages[1].bytes>(uc_, this);
}

void Cpu::forget_blocks_of_flash() {
    for (std::uint32_t half = 0; half < flash_facts_.size(); ++half) {
        if (flash_facts_[half].bytes != 0) {
            forget_block(Memory::kFlashBase + 2 * half);
            flash_facts_[half] = {};
        }
    }
}

/// Unicorn changes the memory after a hook that permits it; undo_flash_store() restores it.
bool Cpu::store_to_flash(std::uint32_t address, std::uint32_t value) {
    undo_flash_store();
    bool taken = false;
    guarded([&] { taken = on_flash_write(address - Memory::kFlashBase, value); });
    flash_store_ = {address, memory_.word(address)};
    return taken || failure_.has_value();
}

void Cpu::undo_flash_store() {
    if (flash_store_) {
        std::memcpy(memory_.at(flash_store_->first, 4).data(), &flash_store_->second, 4);
        flash_store_.reset();
    }
}

void Cpu::forget_flash(std::uint32_t offset, std::uint32_t bytes) {
    constexpr std::uint32_t kLongestBlock = 1024;
    const auto first = flash_facts_.begin() + (offset < kLongestBlock ? 0 : offset - kLongestBlock) / 2;
    const auto last = flash_facts_.begin() + (offset + bytes) / 2;
    flash_has_changed_ = flash_has_changed_ || std::any_of(first, last, [](const BlockFacts& facts) { return facts.bytes != 0; });
}

void Cpu::forget_block(std::uint32_t address) {
    check_unicorn(uc_ctl_remove_cache(uc_, address, address + 1), "translated code");
}

void Cpu::check_division(std::uint32_t address, std::uint32_t bytes) {
    const std::uint32_t word = bytes == 4 ? memory_.word(address) : 0;  // SDIV or UDIV, ARMv7-M A7.7
    fail_if(control_.traps_division() && (word & 0xF0F0FFD0U) == 0xF0F0FB90U &&
                get(UC_ARM_REG_R0 + static_cast<int>(field(word, 16, 4))) == 0,
            "division by zero at {:#010x} with CCR.DIV_0_TRP", address);
}

/// Code in RAM: from now on both ranges of addresses are executable. False: the processor faults.
bool Cpu::open_ram() {
    return uc_mem_protect(uc_, Memory::kRamBase, Memory::kRamBytes, UC_PROT_ALL) == UC_ERR_OK &&
           uc_mem_protect(uc_, Memory::kCcmBase, Memory::kCcmBytes, UC_PROT_ALL) == UC_ERR_OK;
}

/// True if the block at this RAM address may run. Code that was overwritten is translated again (see store_speed.cpp).
bool Cpu::may_run_in_ram(std::uint32_t address, std::uint32_t bytes) {
    if (control_.mpu().forbids(address, true)) {
        failure_ = fmt::format("jump to {:#010x}, which is RAM without code (MPU)", address);
        fault_ = Fault{Fault::Kind::fetch, address};
        return false;
    }
    const auto now = memory_.at(address, bytes);
    auto& before = ram_code_[address];
    const bool same = before.empty() || std::equal(now.begin(), now.end(), before.begin(), before.end());
    before.assign(now.begin(), now.end());
    overwritten_ = same ? std::nullopt : std::optional(address);
    return same;
}

std::uint32_t Cpu::get(int reg) const {
    std::uint32_t value = 0;
    check_unicorn(uc_reg_read(uc_, reg, &value), "register");
    return value;
}

void Cpu::set(int reg, std::uint32_t value) { check_unicorn(uc_reg_write(uc_, reg, &value), "register"); }

std::uint32_t Cpu::pc() const { return get(UC_ARM_REG_PC) & ~1U; }

Masks Cpu::masks() const {
    return {(get(UC_ARM_REG_PRIMASK) & 1U) != 0, (get(UC_ARM_REG_FAULTMASK) & 1U) != 0,
            static_cast<std::uint8_t>(get(UC_ARM_REG_BASEPRI))};
}

void Cpu::reset() {
    for (int r = UC_ARM_REG_R0; r <= UC_ARM_REG_R12; ++r) {
        set(r, 0);
    }
    for (int s = UC_ARM_REG_S0; s <= UC_ARM_REG_S31; ++s) {
        set(s, 0);
    }
    set(UC_ARM_REG_XPSR, kThumb);
    for (const int reg : {UC_ARM_REG_PRIMASK, UC_ARM_REG_FAULTMASK, UC_ARM_REG_BASEPRI, UC_ARM_REG_CONTROL, UC_ARM_REG_PSP}) {
        set(reg, 0);
    }
    set(UC_ARM_REG_LR, 0xFFFFFFFF);
    set(UC_ARM_REG_SP, memory_.word(control_.vector_table()) & ~3U);
    set(UC_ARM_REG_PC, memory_.word(control_.vector_table() + 4));
    running_ = 0;
    float_context_ = false;
    asleep_ = false;
    deeply_asleep_ = false;
    event_ = false;
    halted_ = false;
    in_bootloader_ = false;
    stop_requested_ = false;
}

void Cpu::jump(std::uint32_t address, bool masked) {
    asleep_ = false;
    set(UC_ARM_REG_PRIMASK, masked ? 1 : 0);
    set(UC_ARM_REG_PC, address | 1U);
}

const BlockFacts& Cpu::facts_at(std::uint32_t address, std::uint32_t bytes) {
    const std::uint32_t offset = address - Memory::kFlashBase;
    const bool in_flash = offset < Memory::kBankBytes;
    BlockFacts& facts = in_flash ? flash_facts_[offset / 2] : other_facts_;
    if (!in_flash || facts.bytes != bytes) {
        facts = analyse_block(memory_.at(address, bytes));
    }
    return facts;
}

void Cpu::on_block(std::uint32_t address, std::uint32_t bytes) {
    undo_flash_store();
    block_ = address;
    events_.advance(events_.now());
    if (stop_requested_ || flash_has_changed_ || events_.now() >= limit_ || (nvic_.may_take() && nvic_.to_take(masks()) != 0) ||
        lacks_traps() || (Memory::is_ram(address) && !may_run_in_ram(address, bytes))) {
        stopping_ = true;
        uc_emu_stop(uc_);  // takes effect before the block's first instruction
        return;
    }
    const BlockFacts& facts = facts_at(address, bytes);
    if (facts.first_float != BlockFacts::kNoFloat) {
        use_float(address + facts.first_float);
    }
    event_ = event_ || facts.sends_event;
    in_bootloader_ = address - Memory::kSystemBase < Memory::kSystemBytes;
    add_cycles(facts.instructions);
}

void Cpu::add_cycles(int cycles) {
    cycles_ += static_cast<std::uint64_t>(cycles);
    busy_cycles_ += static_cast<std::uint64_t>(cycles);
    events_.pass(cycles * ticks_per_cycle_);
}

void Cpu::on_interrupt(std::uint32_t number) {
    stopping_ = true;
    if (number == kExceptionReturn) {
        exception_return_ = get(UC_ARM_REG_PC) | 1U;
    } else if (number == kSupervisorCall) {
        nvic_.pend(kSvCall);
    } else {
        failure_ = failure_.value_or(fmt::format("processor fault {}", number));
    }
    uc_emu_stop(uc_);
}

void Cpu::start_sleep(bool until_event) {
    until_event_ = until_event;
    if (until_event && std::exchange(event_, false)) {
        return;
    }
    asleep_ = true;
    if (control_.sleeps_deeply() && on_deep_sleep && !wakes()) {
        deeply_asleep_ = true;
        on_deep_sleep();
    }
}

bool Cpu::wakes() const {
    if (halted_) {
        return false;
    }
    if (until_event_ && (event_ || (control_.pending_is_event() && nvic_.has_pending()))) {
        return true;
    }
    return nvic_.may_take() && nvic_.wakes(masks());
}

void Cpu::sleep() {
    while (!wakes()) {
        const Ticks until = std::min(events_.next(), limit_);
        const Ticks left = std::max<Ticks>(until - events_.now(), 0);
        const Ticks slept = (left + ticks_per_cycle_ - 1) / ticks_per_cycle_;  // whole cycles
        cycles_ += static_cast<std::uint64_t>(slept);
        events_.advance(events_.now() + slept * ticks_per_cycle_);
        if (stop_requested_ || events_.now() >= limit_) {
            return;
        }
    }
    asleep_ = false;
    event_ = event_ && !until_event_;
    if (std::exchange(deeply_asleep_, false)) {
        on_deep_wake();
    }
}

void Cpu::run() {
    stopping_ = false;
    if (lacks_traps()) {
        add_traps();
    }
    if (std::exchange(flash_has_changed_, false)) {
        forget_blocks_of_flash();
    }
    if (overwritten_) {
        forget_block(*overwritten_);
        overwritten_.reset();
    }
    // In steps while a fault is awaited, because within a block the pc of an access is not known.
    const uc_err error = uc_emu_start(uc_, pc() | 1U, 0, 0, takes_fault_ ? 1 : 0);
    undo_flash_store();
    if (failure_) {
        return;
    }
    const auto instruction = [&](std::uint32_t at) {
        const auto bytes = memory_.at(at, 2);
        return bytes.empty() ? 0U : static_cast<std::uint32_t>(bytes[0] | bytes[1] << 8U);
    };
    if (error == UC_ERR_INSN_INVALID && instruction(pc() - 2) == kYield) {
        return;  // a hint; no effect with one processor
    }
    if (error == UC_ERR_INSN_INVALID && instruction(pc() - 2) == kWfe) {
        start_sleep(true);
        return;
    }
    if (error != UC_ERR_OK) {
        failure_ = error == UC_ERR_INSN_INVALID ? "undefined instruction" : uc_strerror(error);
        fault_ = error == UC_ERR_INSN_INVALID ? std::optional(Fault{Fault::Kind::instruction, 0}) : std::nullopt;
    } else if (!stopping_) {
        if (takes_fault_ && instruction(pc() - 2) != kWfi) {
            return;
        }
        if (instruction(pc() - 2) != kWfi) {
            failure_ = "the emulator stopped for an unknown reason";
        }
        start_sleep(false);
    }
}

void Cpu::run_until(Ticks time) {
    limit_ = time;
    stop_requested_ = false;
    try {
        while (events_.now() < limit_ && !stop_requested_) {
            if (asleep_) {
                sleep();
                if (asleep_) {
                    return;
                }
            }
            take_exceptions();
            if (asleep_) {  // SLEEPONEXIT
                continue;
            }
            run();
            if (failure_ && fault_ && takes_fault_) {
                take_fault();
            } else if (failure_) {
                throw RunFailure(*failure_);
            }
        }
        events_.advance(events_.now());
    } catch (const RunFailure& failure) {
        failure_.reset();
        fault_.reset();
        const std::uint32_t at = pc();
        throw RunFailure(fmt::format("{:#010x}: {}", at, failure.what()));
    }
}

}  // namespace tricoil::virtual_board
