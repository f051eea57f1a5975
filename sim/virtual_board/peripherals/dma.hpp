// Direct memory access controllers 1 and 2 with their request multiplexer (RM0440 sections 12 and 13).
#pragma once

#include <array>
#include <functional>
#include <map>

#include "sim/virtual_board/machine/machine.hpp"
#include "sim/virtual_board/machine/register_file.hpp"

namespace tricoil::virtual_board {

/// Serves every request at once; a memory-to-memory transfer is complete when its channel is enabled.
class Dma {
public:
    static constexpr unsigned kControllers = 2;
    static constexpr unsigned kChannels = 8;  // of each controller

    explicit Dma(Machine& machine);

    /// A peripheral requests the transfer of one item. False: no enabled channel has this request.
    bool request(unsigned id);
    /// `act` is called when a channel with this request is enabled: the peripheral repeats a request that still waits.
    void on_enable(unsigned id, std::function<void()> act) { waiting_[id] = std::move(act); }
    /// Emulates a broken controller: no request is served.
    void set_stuck(bool stuck) { stuck_ = stuck; }

    Peripheral& controller(unsigned n) { return controllers_.at(n); }
    Peripheral& multiplexer() { return multiplexer_; }

private:
    struct Channel {
        std::uint32_t control = 0;
        std::uint32_t left = 0;
        std::uint32_t reload = 0;
        std::uint32_t peripheral = 0;
        std::uint32_t memory = 0;
        std::uint32_t at = 0;  // items since the last reload
    };
    class Controller final : public Peripheral {
    public:
        Controller(Dma& dma, unsigned number) : dma_(dma), number_(number) {}
        [[nodiscard]] bool accepts(unsigned channel) const;
        void move(unsigned channel);

        std::uint32_t read(std::uint32_t offset) override;
        void write(std::uint32_t offset, std::uint32_t value) override;
        [[nodiscard]] std::span<const Register> registers() const override;
        void reset() override;

    private:
        void enable(unsigned channel);
        void copy(const Channel& channel);
        [[nodiscard]] std::uint32_t fetch(std::uint32_t address, unsigned bytes);
        void store(std::uint32_t address, std::uint32_t value, unsigned bytes);
        void show_interrupt(unsigned channel);
        std::uint32_t& word(std::uint32_t offset);

        Dma& dma_;
        unsigned number_;
        std::array<Channel, kChannels> channels_{};
        std::uint32_t flags_ = 0;
    };
    class Multiplexer final : public RegisterPeripheral {
    public:
        Multiplexer();
        [[nodiscard]] std::uint32_t request(unsigned channel) const { return registers_[4 * channel]; }

    private:
        void apply(std::uint32_t offset, std::uint32_t value) override;
    };

    void enabled(unsigned id);

    Machine& machine_;
    std::array<Controller, kControllers> controllers_;
    Multiplexer multiplexer_;
    std::map<unsigned, std::function<void()>> waiting_;
    bool stuck_ = false;
};

}  // namespace tricoil::virtual_board
