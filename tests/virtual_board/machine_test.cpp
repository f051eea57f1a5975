// The processor of the virtual board: ARMv7-M exceptions, time, run-ending errors. The image is firmware/processor.
#include <dlfcn.h>
#include <gmock/gmock.h>

#include <cstring>
#include <fstream>

#include "board/support/errors.hpp"
#include "board/virtual_board/symbols_file.hpp"
#include "sim/virtual_board/machine/machine.hpp"
#include "sim/virtual_board/machine/run_failure.hpp"
#include "sim/virtual_board/machine/store_speed.hpp"
#include "sim/virtual_board/machine/symbols.hpp"
#include "tests/virtual_board/firmware/mailbox.hpp"

namespace tricoil::virtual_board {
namespace {

using test::Job;
using test::Mailbox;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

constexpr int kSvc = 100 + 11;
constexpr int kTick = 100 + 15;
constexpr int enters(int interrupt) { return 100 + 16 + interrupt; }
constexpr int leaves(int interrupt) { return 200 + 16 + interrupt; }

std::vector<std::uint8_t> read_image(const std::string& path) {
    std::ifstream file(path, std::ios::binary);
    return {std::istreambuf_iterator<char>(file), {}};
}

class Processor : public ::testing::Test {
protected:
    Processor() { machine_.load(read_image(TRICOIL_TEST_FIRMWARE "/processor.bin")); }

    Mailbox& mailbox() { return *reinterpret_cast<Mailbox*>(machine_.memory.at(test::kMailbox, sizeof(Mailbox)).data()); }

    /// Runs a job; returns the words that the image recorded.
    std::vector<std::uint32_t> run(Job job, double for_s = 0.01) {
        mailbox() = {job, 0, 0, 0, {}};
        machine_.reset();
        machine_.run_until(machine_.now() + ticks(for_s));
        EXPECT_EQ(mailbox().done, 1U);
        return {mailbox().results, mailbox().results + mailbox().count};
    }

    /// The error that ended the job.
    std::string failure(Job job) {
        mailbox() = {job, 0, 0, 0, {}};
        machine_.reset();
        try {
            machine_.run_until(machine_.now() + ticks(0.01));
        } catch (const RunFailure& failure) {
            return failure.what();
        }
        return "the job did not fail";
    }

    Machine machine_;
};

TEST_F(Processor, CountsEveryInstructionAsOneCycle) {
    run(Job::nothing);
    const std::uint64_t nothing = machine_.cpu.busy_cycles();
    run(Job::count_instructions);
    const std::uint64_t loop = machine_.cpu.busy_cycles() - 2 * nothing;
    EXPECT_NEAR(static_cast<double>(loop), 2000, 30);
    EXPECT_THAT(run(Job::cycle_counter), ElementsAre(::testing::AllOf(::testing::Ge(100U), ::testing::Le(110U))));
}

TEST_F(Processor, NestsAHigherPriority) { EXPECT_THAT(run(Job::nest_interrupts), ElementsAre(enters(0), enters(1), leaves(0))); }

TEST_F(Processor, TailChainsAnEqualPriority) { EXPECT_THAT(run(Job::tail_chain), ElementsAre(enters(0), leaves(0), enters(1))); }

TEST_F(Processor, EntersTheMoreUrgentFirst) { EXPECT_THAT(run(Job::late_arrival), ElementsAre(enters(1), enters(2))); }

TEST_F(Processor, MasksByBasepri) { EXPECT_THAT(run(Job::mask_by_basepri), ElementsAre(enters(2), 1, enters(1), 2)); }

TEST_F(Processor, MasksByPrimaskButWakes) { EXPECT_THAT(run(Job::mask_by_primask), ElementsAre(1, 2, enters(1), 3)); }

TEST_F(Processor, SavesFloatRegistersOnlyWhenAHandlerUsesThem) {
    const auto seen = run(Job::lazy_float);
    ASSERT_EQ(seen.size(), 10U);
    EXPECT_EQ(seen[0], 4U) << "CONTROL.FPCA after use";
    EXPECT_EQ(seen[1], enters(0));
    EXPECT_EQ(seen[2], 1U) << "FPCCR.LSPACT in the handler";
    EXPECT_EQ(seen[3], 1U) << "room is on the stack";
    EXPECT_NE(seen[4], 0x40400000U) << "nothing saved yet";
    EXPECT_EQ(seen[5], 0U) << "LSPACT after use";
    EXPECT_EQ(seen[6], 0x40400000U) << "S0 is saved";
    EXPECT_EQ(seen[7], 4U) << "FPCA in the handler";
    EXPECT_EQ(seen[8], leaves(0));
    EXPECT_EQ(seen[9], 3U) << "S0 is restored";
}

TEST_F(Processor, ReturnsToTheProcessStack) { EXPECT_THAT(run(Job::process_stack), ElementsAre(enters(1), 1, 1, 1)); }

TEST_F(Processor, TakesSystemCalls) { EXPECT_THAT(run(Job::system_call), ElementsAre(kSvc, 1)); }

TEST_F(Processor, HintsDoNothing) { EXPECT_THAT(run(Job::hints), ElementsAre(1)); }

TEST_F(Processor, SleepsUntilTheTick) {
    EXPECT_THAT(run(Job::sys_tick_sleep, 0.004), ElementsAre(kTick, kTick, kTick));
    EXPECT_LT(machine_.cpu.busy_cycles(), 2000U);
}

TEST_F(Processor, SleepsAgainAtTheEndOfAHandler) {
    mailbox() = {Job::sleep_on_exit, 0, 0, 0, {}};
    machine_.reset();
    machine_.run_until(machine_.now() + ticks(0.0035));
    EXPECT_THAT(std::vector(mailbox().results, mailbox().results + mailbox().count), ElementsAre(kTick, kTick, kTick));
    EXPECT_EQ(mailbox().done, 0U);
}

TEST_F(Processor, ResetsItself) {
    run(Job::reset_itself);
    EXPECT_EQ(mailbox().boots, 3U);
}

TEST_F(Processor, EndsInTheBootloader) {
    mailbox() = {Job::bootloader, 0, 0, 0, {}};
    machine_.reset();
    machine_.run_until(machine_.now() + ticks(0.01));
    EXPECT_TRUE(machine_.cpu.in_bootloader());
}

TEST_F(Processor, FailsWithAddressAndReason) {
    const Symbols symbols = read_symbols(TRICOIL_TEST_FIRMWARE "/processor.elf");
    const std::map<Job, std::string> reasons{
        {Job::read_nowhere, "read from 0x30000000"},
        {Job::write_flash, "write to 0x08001000, which is flash"},
        {Job::undefined, "undefined instruction"},
        {Job::jump_nowhere, "jump to 0x30000000"},
        {Job::float_while_off, "before CPACR enables it"},
        {Job::unclocked, "no peripheral at 0x48000000"},
        {Job::no_handler, "exception 56 (interrupt 40) has no handler"},
        {Job::stack_overflow, "stack pointer"},
    };
    for (const auto& [job, reason] : reasons) {
        const std::string failed = failure(job);
        EXPECT_THAT(failed, HasSubstr(reason));
        const auto pc = static_cast<std::uint32_t>(std::stoul(failed, nullptr, 16));
        EXPECT_TRUE(job == Job::jump_nowhere || !symbols.name_of(pc).empty()) << failed;
    }
    EXPECT_THAT(symbols.name_of(*symbols.address_of("run") & ~1U), "run");
}

/// On request a fault is an exception, as on the chip.
TEST_F(Processor, TakesAFaultAsHardFault) {
    const Symbols symbols = read_symbols(TRICOIL_TEST_FIRMWARE "/processor.elf");
    constexpr std::uint32_t kForced = 1U << 30U;
    struct Expected {
        Job job;
        std::uint32_t cfsr;
        std::uint32_t address;
    };
    for (const auto& [job, cfsr, address] : {Expected{Job::read_nowhere, 1U << 9U | 1U << 15U, 0x30000000},
                                             Expected{Job::write_flash, 1U << 9U | 1U << 15U, 0x08001000},
                                             Expected{Job::undefined, 1U << 16U, 0}, Expected{Job::jump_nowhere, 1U << 8U, 0}}) {
        machine_.cpu.take_next_fault();
        const auto seen = run(job);
        ASSERT_EQ(seen.size(), 5U) << static_cast<int>(job);
        EXPECT_EQ(seen[0], 103U);
        EXPECT_EQ(seen[1], cfsr) << static_cast<int>(job);
        EXPECT_EQ(seen[2], kForced);
        EXPECT_EQ(seen[3], address);
        EXPECT_TRUE(job == Job::jump_nowhere ? seen[4] == 0x30000000 : symbols.name_of(seen[4]).starts_with("run"))
            << std::hex << seen[4];
        EXPECT_TRUE(job != Job::read_nowhere || (machine_.memory.word(seen[4]) & 0xF800U) == 0x6800U) << "LDR (immediate)";
    }
    EXPECT_THAT(failure(Job::read_nowhere), HasSubstr("read from 0x30000000")) << "only the requested fault is an exception";
}

/// With SHCSR a fault is its own exception, which HFSR does not show.
TEST_F(Processor, TakesAFaultAsItsOwnException) {
    for (const auto& [job, exception] : {std::pair{Job::bus_fault, 5U}, std::pair{Job::usage_fault, 6U}}) {
        machine_.cpu.take_next_fault();
        const auto seen = run(job);
        ASSERT_EQ(seen.size(), 5U);
        EXPECT_EQ(seen[0], 100 + exception);
        EXPECT_EQ(seen[2], 0U) << "HFSR";
    }
}

/// Regions of the tracker's firmware: a guard below RAM, and no code in RAM.
TEST_F(Processor, MemoryProtectionTellsForbiddenFromMissing) {
    SystemControl& control = machine_.control;
    const auto region = [&](std::uint32_t number, std::uint32_t base, std::uint32_t attributes) {
        control.write(0x9C, base | 1U << 4U | number);
        control.write(0xA0, attributes | 1U);
    };
    constexpr std::uint32_t kNoAccess = 0;
    constexpr std::uint32_t kFull = 3U << 24U;
    constexpr std::uint32_t kNoExecute = 1U << 28U;
    const auto size = [](unsigned log2_bytes) { return (log2_bytes - 1) << 1U; };
    EXPECT_EQ(control.read(0x90), 0x800U);
    region(0, 0x1FFF8000, kNoAccess | size(15));
    region(1, 0x20000000, kFull | kNoExecute | size(17));
    EXPECT_FALSE(control.mpu().forbids(0x1FFFFFFC, false)) << "the unit is off";
    control.write(0x94, 5);
    EXPECT_TRUE(control.mpu().forbids(0x1FFFFFFC, false));
    EXPECT_TRUE(control.mpu().forbids(0x1FFF8000, false));
    EXPECT_FALSE(control.mpu().forbids(0x1FFF7FFC, false));
    EXPECT_FALSE(control.mpu().forbids(0x20000000, false));
    EXPECT_TRUE(control.mpu().forbids(0x20000000, true));
    EXPECT_FALSE(control.mpu().forbids(0x20020000, true));
    const auto refusal = [](auto act) -> std::string {
        try {
            act();
        } catch (const RunFailure& failure) {
            return failure.what();
        }
        return "accepted";
    };
    EXPECT_THAT(refusal([&] { region(2, 0x20000000, kNoAccess | size(12)); }), HasSubstr("forbids access to memory"));
    control.reset();
    EXPECT_THAT(refusal([&] { control.write(0x94, 1); }), HasSubstr("without PRIVDEFENA"));
    EXPECT_THAT(refusal([&] { control.write(0x94, 7); }), HasSubstr("HFNMIENA"));
    control.write(0x94, 5);
    EXPECT_THAT(refusal([&] { region(0, 0x20000000, kFull | size(15) | 1U << 8U); }), HasSubstr("SRD"));
    EXPECT_THAT(refusal([&] { region(0, 0x20001000, kFull | size(17)); }), HasSubstr("a multiple of the size"));
}

TEST_F(Processor, RefusesInvalidImages) {
    EXPECT_THROW(machine_.load(std::vector<std::uint8_t>(8)), std::invalid_argument);
    EXPECT_THROW(machine_.load(std::vector<std::uint8_t>(4096, 0xFF)), std::invalid_argument);
    EXPECT_THROW((void)read_symbols("/nowhere.elf"), host::InputError);
}

TEST_F(Processor, RepeatsToTheLastCycle) {
    std::vector<std::uint64_t> cycles;
    for (int n = 0; n < 3; ++n) {
        Machine machine;
        machine.load(read_image(TRICOIL_TEST_FIRMWARE "/processor.bin"));
        const Mailbox job{Job::sys_tick_sleep, 0, 0, 0, {}};
        std::memcpy(machine.memory.at(test::kMailbox, sizeof job).data(), &job, sizeof job);
        machine.reset();
        machine.run_until(ticks(0.01));
        cycles.push_back(machine.cpu.busy_cycles());
    }
    EXPECT_EQ(cycles[0], cycles[1]);
    EXPECT_EQ(cycles[1], cycles[2]);
}

/// First byte of the program or library that contains an address.
const void* object_of(const void* address) {
    Dl_info info{};
    return dladdr(address, &info) != 0 ? info.dli_fbase : nullptr;
}

// Without them, a run takes 1.7 times as long.
TEST(StoreSpeed, TheEmulatorFindsTheFastStores) {
    const void* const here = object_of(reinterpret_cast<const void*>(&use_fast_stores));
    for (const char* const name :
         {"page_collection_lock_arm", "page_collection_unlock_arm", "tb_invalidate_phys_page_fast_arm"}) {
        EXPECT_EQ(object_of(dlsym(RTLD_DEFAULT, name)), here) << name;
    }
}

}  // namespace
}  // namespace tricoil::virtual_board
