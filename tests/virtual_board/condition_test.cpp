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
    ReportingBoard() { send_hello(); }
    void send_hello() {
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
    /// Starts to measure, applies a fault of --fault, and boots again. Expects coils off within this time.
    ConditionMessage after(const std::string& fault, double off_within_s = 1e-3) {
        EXPECT_EQ(ask(test::on_serial, Opcode::start), protocol::AckResult::done);
        fed[test::on_serial] = true;
        run(0.2);
        EXPECT_TRUE(board->bench.any_driven());
        virtual_board::BoardFaults faults(*board, {virtual_board::parse_board_fault(fault)});
        faults.update();
        const double begin_s = board->now_s();
        fed[test::on_serial] = false;
        run(1);
        EXPECT_LT(board->bench.last_driven_s() - begin_s, off_within_s) << fault;
        send_hello();
        return condition();
    }
};

enum Reason : std::uint8_t { kPowerOn, kResetPin, kSoftware, kWatchdog, kProgramError };
enum Crash : std::uint8_t { kNone, kFault, kAssertion, kHung, kStack };
enum Image : std::uint8_t { kUnchecked, kSound, kDamaged };
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
    board.send_hello();
    c = board.condition();
    EXPECT_EQ(c.reset_reason, kSoftware);
    EXPECT_EQ(c.crash, kFault) << "the record stays";
    EXPECT_EQ(c.address, kBadAddress);

    board.board->power_cycle();
    board.send_hello();
    c = board.condition();
    EXPECT_EQ(c.reset_reason, kPowerOn);
    EXPECT_EQ(c.crash, kNone);
}

TEST(BoardCondition, TellsTheOtherReasons) {
    ReportingBoard board;
    ConditionMessage c = board.after("hang_masked", virtual_board::CoilBench::kHeartbeatHoldS + 5e-3);
    EXPECT_EQ(c.reset_reason, kWatchdog);
    EXPECT_EQ(c.crash, kHung);
    c = board.after("stack_overflow");
    EXPECT_EQ(c.reset_reason, kProgramError);
    EXPECT_EQ(c.crash, kStack);
    EXPECT_EQ(c.cfsr, 0x92U) << "the MPU forbade the push, and that of the exception entry";
    EXPECT_LT(virtual_board::Memory::kRamBase - c.address, 64U) << std::hex << c.address;
    EXPECT_EQ(c.pc, 0U) << "the processor could not store it";
    EXPECT_EQ(c.crashes, 2U);
    c = board.after("code_in_ram");
    EXPECT_EQ(c.crash, kFault);
    EXPECT_EQ(c.cfsr, 0x01U) << "the MPU forbade the instruction";
    EXPECT_EQ(c.pc, virtual_board::Memory::kRamBase);
    EXPECT_EQ(c.crashes, 3U);
}

TEST(BoardCondition, FindsTheImageSound) {
    ReportingBoard board;
    const ConditionMessage c = board.condition();
    EXPECT_EQ(c.image, kSound);
    EXPECT_EQ(board.status().faults & static_cast<unsigned>(protocol::Fault::self_check), 0U);
}

/// One bit of the header's end address, text or CRC, or of the last word, is wrong: the board communicates, but drives no coil.
TEST(BoardCondition, ADamagedImageKeepsTheCoilsOff) {
    const std::vector<std::uint8_t> image = test::read_image(TRICOIL_BOARD_IMAGE ".bin");
    constexpr std::size_t kEnd = 0x220F;  // its highest byte: an end outside the flash
    constexpr std::size_t kCommit = 0x2210;
    constexpr std::size_t kCrc = 0x2230;
    for (const std::size_t at : {kEnd, kCommit, kCrc, image.size() - 1}) {
        ReportingBoard board;
        board.board->machine.memory.flash[at] ^= 0x10;
        board.board->power_cycle();
        board.send_hello();
        const ConditionMessage c = board.condition();
        EXPECT_EQ(c.image, kDamaged) << at;
        EXPECT_NE(board.status().faults & static_cast<unsigned>(protocol::Fault::self_check), 0U) << at;
        EXPECT_EQ(board.ask(test::on_serial, Opcode::start), protocol::AckResult::failed) << at;
        board.host().command(Opcode::read_block, 0, Excitation::s1);
        board.run(0.1);
        EXPECT_EQ(board.host().result(), protocol::AckResult::failed) << at;
        EXPECT_LT(board.board->bench.last_driven_s(), 0) << "the coils were never on";
    }
}

TEST(BoardCondition, ChecksTheOptionBytes) {
    struct Case {
        const char* fault;
        std::uint16_t settings;
    };
    enum : std::uint16_t {
        kChecked = 1,
        kBrownOut = 2,
        kLevelOne = 4,
        kLevelTwo = 8,
        kOneBank = 16,
        kBankTwo = 32,
        kNotFlash = 64
    };
    for (const auto& [fault, settings] : {Case{"option_bytes:0xFFEFF8AA", kBrownOut}, Case{"option_bytes:0xFFEFFCAA", 0},
                                          Case{"option_bytes:0xFFEFFCBB", kLevelOne}, Case{"option_bytes:0xFFEFFCCC", kLevelTwo},
                                          Case{"option_bytes:0xFFAFFCAA", kOneBank}, Case{"option_bytes:0xFFFFFCAA", kBankTwo},
                                          Case{"option_bytes:0xF3EFFCAA", kNotFlash}, Case{"option_bytes:0xFBEFFCAA", 0}}) {
        ReportingBoard board;
        virtual_board::BoardFaults faults(*board.board, {virtual_board::parse_board_fault(fault)});
        faults.update();
        board.board->power_cycle();
        board.send_hello();
        const ConditionMessage c = board.condition();
        EXPECT_EQ(c.settings, kChecked | settings) << fault;
        EXPECT_EQ(c.options, std::stoul(std::string(fault).substr(13), nullptr, 16));
    }
}

TEST(BoardCondition, MeasuresSupplyAndTemperature) {
    ReportingBoard board;
    EXPECT_NEAR(board.status().supply_mv, 3300, 10);
    EXPECT_NEAR(board.status().temperature_cdeg, 3000, 150);
    board.board->shown_supply_v = 3.1;
    board.board->chip_celsius = 85;
    board.run(1.5);
    EXPECT_NEAR(board.status().supply_mv, 3100, 10);
    EXPECT_NEAR(board.status().temperature_cdeg, 8500, 150);
    EXPECT_EQ(board.status().faults & 0x30U, 0U);
    board.board->shown_supply_v = 2.9;
    board.board->chip_celsius = 110;
    board.run(1.5);
    EXPECT_EQ(board.status().faults & 0x30U, 0x30U) << "temperature and supply out of limits";
    board.board->adc(1).set_stuck(true);
    board.run(1.5);
    EXPECT_EQ(board.status().supply_mv, 0U) << "not measured";
}

TEST(BoardPermission, IsGivenByTheButtonOnly) {
    ReportingBoard board;
    const auto loader = [&](std::size_t link) { return board.ask(link, Opcode::loader, protocol::kLoaderKey); };
    board.host(test::on_can).hello();
    board.run(0.02);
    EXPECT_EQ(loader(test::on_can), protocol::AckResult::refused) << "an unknown node of the bus";
    EXPECT_EQ(loader(test::on_serial), protocol::AckResult::refused);
    EXPECT_EQ(board.condition().permission_s, 0);
    board.press_button();
    EXPECT_EQ(board.condition().permission_s, 60);
    board.run(60);
    EXPECT_EQ(loader(test::on_serial), protocol::AckResult::refused) << "too late";
    board.press_button();
    EXPECT_EQ(loader(test::on_serial), protocol::AckResult::done);
    board.run(0.2);
    EXPECT_TRUE(board.board->machine.cpu.in_bootloader());
}

}  // namespace
}  // namespace tricoil
