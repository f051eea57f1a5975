// Flash image of the tracker board on the virtual board, with a host on each link.
#pragma once

#include <fmt/format.h>

#include <fstream>
#include <iterator>
#include <optional>

#include "board/support/sim_input/fault_text.hpp"
#include "board/support/sim_input/scenario_file.hpp"
#include "board/virtual_board/symbols_file.hpp"
#include "core/protocol/convert.hpp"
#include "sim/virtual_board/machine/symbols.hpp"
#include "sim/virtual_board/run_report.hpp"
#include "sim/world/scenario.hpp"
#include "tests/app/host_end.hpp"
#include "tests/virtual_board/wire_ends.hpp"

namespace tricoil::protocol {

/// Flags of a column message without its gain step.
constexpr std::uint16_t flag_bits(const ColumnMessage& m) { return m.flags & ((1U << kGainStepBit) - 1); }

}  // namespace tricoil::protocol

namespace tricoil::test {

inline std::vector<std::uint8_t> read_image(const std::string& path) {
    std::ifstream file(path, std::ios::binary);
    if (!file) {
        throw std::runtime_error(path + ": cannot be opened; run toolchain/build nucleo-g474re");
    }
    return {std::istreambuf_iterator<char>(file), {}};
}

enum LinkNumber : std::size_t { on_serial, on_can, on_usb, link_numbers };

class BoardBench {
public:
    explicit BoardBench(const std::string& scenario_name = "hand", const std::vector<std::string>& faults = {})
        : BoardBench(with_faults(host::load_scenario(scenario_name, 1), faults)) {}

    explicit BoardBench(sim::Scenario what, const virtual_board::BoardCircuit& circuit = virtual_board::BoardCircuit::draw(0))
        : scenario(std::move(what)) {
        board.emplace(read_image(TRICOIL_BOARD_IMAGE ".bin"), scenario, circuit);
        ends[on_serial] = std::make_unique<SerialEnd>(*board);
        ends[on_can] = std::make_unique<CanEnd>(*board);
        ends[on_usb] = std::make_unique<UsbEnd>(*board);
        for (const auto& end : ends) {
            hosts.push_back(std::make_unique<HostEnd>(end->port()));
        }
        hash_outputs();
    }

    HostEnd& host(std::size_t n = on_serial) { return *hosts[n]; }

    /// Runs for a time; hosts receive, and active hosts send keep-alives. An error fails the test with address and reason.
    void run(double duration_s) {
        const double end = board->now_s() + duration_s;
        try {
            while (board->now_s() < end - 1e-9 && !board->machine.cpu.in_bootloader()) {
                board->run_until(std::min(board->now_s() + kStepS, end));
                serve();
            }
        } catch (const virtual_board::RunFailure& failure) {
            const auto pc = static_cast<std::uint32_t>(std::stoul(failure.what(), nullptr, 16));
            const std::string text = fmt::format("{:.6f} s: {} in {}", board->now_s(), failure.what(), symbols.name_of(pc));
            throw std::runtime_error(text);
        }
    }

    /// Sends `opcode` on a link; returns its result.
    std::optional<protocol::AckResult> ask(std::size_t link, protocol::Opcode opcode, std::uint32_t argument = 0) {
        host(link).command(opcode, argument);
        for (int n = 0; n < 150 && !host(link).result(); ++n) {
            run(0.002);
        }
        return host(link).result();
    }

    /// Boots, sends hello, and starts measuring for these links.
    void start(const std::vector<std::size_t>& links) {
        run(kBootS);
        for (const std::size_t link : links) {
            host(link).hello();
            run(0.01);
            EXPECT_EQ(ask(link, protocol::Opcode::start), protocol::AckResult::done) << "link " << link;
            fed[link] = true;
        }
    }

    /// A person presses the button B1: permits one loader or calibration command. The board must have seen it open before.
    void press_button() {
        run(0.05);
        board->press_button(true);
        run(0.1);
        board->press_button(false);
        run(0.05);
    }

    [[nodiscard]] protocol::StatusMessage status(std::size_t link = on_serial) {
        const std::size_t before = host(link).statuses.size();
        for (int n = 0; n < 150 && host(link).statuses.size() == before; ++n) {
            run(0.01);
        }
        return host(link).statuses.empty() ? protocol::StatusMessage{} : host(link).statuses.back();
    }

    static constexpr double kBootS = 0.4;

    sim::Scenario scenario;
    virtual_board::Symbols symbols = virtual_board::read_symbols(TRICOIL_BOARD_IMAGE ".elf");
    std::optional<virtual_board::VirtualBoard> board;
    std::array<std::unique_ptr<WireEnd>, link_numbers> ends;
    std::vector<std::unique_ptr<HostEnd>> hosts;
    std::array<bool, link_numbers> fed{};
    virtual_board::OutputHash hash;
    std::function<void()> at_each_step;

private:
    static sim::Scenario with_faults(sim::Scenario scenario, const std::vector<std::string>& faults) {
        for (const std::string& fault : faults) {
            scenario.faults.push_back(host::parse_fault(fault));
        }
        return scenario;
    }

    static constexpr double kStepS = 0.5e-3;
    static constexpr double kFeedS = 0.05;

    void serve() {
        const bool feeds = board->now_s() - fed_s_ >= kFeedS;
        fed_s_ = feeds ? board->now_s() : fed_s_;
        for (std::size_t n = 0; n < link_numbers; ++n) {
            if (feeds && fed[n]) {
                host(n).keep_alive();
            }
            ends[n]->serve();
            host(n).listen();
        }
        if (at_each_step) {
            at_each_step();
        }
    }

    void hash_outputs() {
        using Link = virtual_board::OutputHash::Link;
        board->serial.on_byte = [this, before = board->serial.on_byte](std::uint8_t byte) {
            hash.add(Link::serial, {&byte, 1});
            before(byte);
        };
        board->can.on_frame = [this, before = board->can.on_frame](const virtual_board::CanFrame& frame) {
            hash.add(Link::can, frame.data);
            before(frame);
        };
    }

    double fed_s_ = 0;
};

}  // namespace tricoil::test
