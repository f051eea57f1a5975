// The flash image reports its condition: program errors across a reset.
#include <gmock/gmock.h>

#include "board/virtual_board/board_fault_text.hpp"
#include "sim/virtual_board/board_fault.hpp"
#include "tests/virtual_board/board_bench.hpp"

namespace tricoil {
namespace {

using protocol::ConditionMessage;
using protocol::Opcode;
using test::BoardBench;

/// Board with a session on its serial link.
class ReportingBoard : public BoardBench {
public:
    ReportingBoard() { greet(); }
    void greet() {
        run(kBootS);
        host().hello();
        run(0.02);
    }
    ConditionMessage condition() {
        const std::size_t before = host().conditions.size();
        host().command(Opcode::read_condition);
        for (int n = 0; n < 50 && host().conditions.size() == before; ++n) {
            run(0.005);
        }
        EXPECT_GT(host().conditions.size(), before);
        return host().conditions.size() > before ? host().conditions.back() : ConditionMessage{};
    }
    /// Starts to measure, applies a fault of --fault, and boots again. Expects coils off at once.
    ConditionMessage after(const std::string& fault) {
        EXPECT_EQ(ask(test::on_serial, Opcode::start), protocol::AckResult::done);
        fed[test::on_serial] = true;
        run(0.2);
        EXPECT_TRUE(board->bench.any_driven());
        virtual_board::BoardFaults faults(*board, {virtual_board::parse_board_fault(fault)});
        faults.update();
        const double begin_s = board->now_s();
        fed[test::on_serial] = false;
        run(1);
        EXPECT_LT(board->bench.last_driven_s() - begin_s, 1e-3) << fault;
        greet();
        return condition();
    }
};

enum Reason : std::uint8_t { kPowerOn, kResetPin, kSoftware, kWatchdog, kProgramError };
enum Crash : std::uint8_t { kNone, kFault, kAssertion, kHung, kStack };
constexpr std::uint32_t kBadAddress = 0x30000000;  // of the fault bad_access
constexpr std::uint16_t kHardFault = 3;

TEST(BoardCondition, HasNoCrashAfterPowerOn) {
    ReportingBoard board;
    const ConditionMessage c = board.condition();
    EXPECT_EQ(c.reset_reason, kPowerOn);
    EXPECT_EQ(c.crash, kNone);
    EXPECT_EQ(c.crashes, 0U);
    EXPECT_EQ(c.pc, 0U);
}

TEST(BoardCondition, TellsTheProcessorFaultUntilThePowerIsOff) {
    ReportingBoard board;
    ConditionMessage c = board.after("bad_access");
    EXPECT_EQ(c.reset_reason, kProgramError);
    EXPECT_EQ(c.crash, kFault);
    EXPECT_EQ(c.crashes, 1U);
    EXPECT_EQ(c.exception, kHardFault);
    EXPECT_EQ(c.pc, virtual_board::address_of(virtual_board::InjectedCode::bad_access) + 4) << std::hex << c.pc;
    EXPECT_NE(c.lr, 0U);
    EXPECT_EQ(c.cfsr, 0x8200U) << "precise data bus error with address";
    EXPECT_EQ(c.address, kBadAddress);

    board.board->machine.request_reset();
    board.greet();
    c = board.condition();
    EXPECT_EQ(c.reset_reason, kSoftware);
    EXPECT_EQ(c.crash, kFault) << "the record stays";
    EXPECT_EQ(c.address, kBadAddress);

    board.board->power_cycle();
    board.greet();
    c = board.condition();
    EXPECT_EQ(c.reset_reason, kPowerOn);
    EXPECT_EQ(c.crash, kNone);
}

TEST(BoardCondition, TellsTheOtherReasons) {
    ReportingBoard board;
    ConditionMessage c = board.after("hang_masked");
    EXPECT_EQ(c.reset_reason, kWatchdog);
    EXPECT_EQ(c.crash, kHung);
    c = board.after("stack_overflow");
    EXPECT_EQ(c.reset_reason, kProgramError);
    EXPECT_EQ(c.crash, kStack);
    EXPECT_EQ(c.pc, 0U) << "the processor could not store it";
    EXPECT_EQ(c.crashes, 2U);
    c = board.after("code_in_ram");
    EXPECT_EQ(c.crash, kFault);
    EXPECT_EQ(c.pc, virtual_board::Memory::kRamBase);
    EXPECT_EQ(c.crashes, 3U);
}

}  // namespace
}  // namespace tricoil
