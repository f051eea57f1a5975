// Direct memory access controller 1 with its request multiplexer (RM0440 sections 12 and 13).
#pragma once

#include <array>

#include "sim/virtual_board/machine/machine.hpp"
#include "sim/virtual_board/peripherals/register_file.hpp"

namespace tricoil::virtual_board {

/// Serves every request at once.
class Dma final : public Peripheral {
public:
    static constexpr unsigned kChannels = 8;

    explicit Dma(Machine& machine);

    /// A peripheral requests the transfer of one item. False: no enabled channel has this request.
    bool request(unsigned id);
    /// Emulates a broken controller: no request is served.
    void set_stuck(bool stuck) { stuck_ = stuck; }

    Peripheral& multiplexer() { return multiplexer_; }

    std::uint32_t read(std::uint32_t offset) override;
    void write(std::uint32_t offset, std::uint32_t value) override;
    void reset() override;

private:
    struct Channel {
        std::uint32_t control = 0;
        std::uint32_t left = 0;
        std::uint32_t reload = 0;
        std::uint32_t peripheral = 0;
        std::uint32_t memory = 0;
        std::uint32_t at = 0;  // items since the last reload
    };
    class Multiplexer final : public Peripheral {
    public:
        std::uint32_t read(std::uint32_t offset) override;
        void write(std::uint32_t offset, std::uint32_t value) override;
        void reset() override { requests.fill(0); }
        std::array<std::uint32_t, 16> requests{};
    };

    void move(unsigned n);
    void show_interrupt(unsigned n);
    std::uint32_t& word(std::uint32_t offset);

    Machine& machine_;
    std::array<Channel, kChannels> channels_{};
    Multiplexer multiplexer_;
    std::uint32_t flags_ = 0;
    bool stuck_ = false;
};

}  // namespace tricoil::virtual_board
