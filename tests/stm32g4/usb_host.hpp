// Simulated USB host: changes the endpoint registers as the USB hardware does when a host sends tokens.
#pragma once

#include <gtest/gtest.h>

#include <optional>

#include "drivers/stm32g4/registers/usb.hpp"
#include "tests/stm32g4/framed.hpp"

namespace tricoil::test {

/// Answer of a device to a token.
enum class Handshake { none, ack, nak, stall };

/// Content of an endpoint register with content `old` after a write of `word`.
constexpr std::uint16_t after_write(std::uint16_t old, std::uint16_t word) {
    using namespace stm32g4::usb;
    constexpr std::uint16_t kToggles = EP_DTOG_RX | EP_STAT_RX | EP_DTOG_TX | EP_STAT_TX;
    constexpr std::uint16_t kFlags = EP_CTR_RX | EP_CTR_TX;
    constexpr std::uint16_t kPlain = EP_TYPE | EP_KIND | EP_EA;
    return static_cast<std::uint16_t>((old & word & kFlags) | ((old ^ word) & kToggles) | (word & kPlain) | (old & EP_SETUP));
}

/// Works on the plain structures that the driver uses as registers. `Port` has on_interrupt().
template <typename Port>
class UsbHost {
public:
    UsbHost(stm32g4::UsbRegisters& registers, stm32g4::UsbPacketMemory& memory, Port& port)
        : registers_(registers), memory_(memory), port_(port) {}

    /// Calls the driver's interrupt handler with these flags in addition to those of the endpoints.
    void interrupt(std::uint16_t flags = 0) {
        using namespace stm32g4::usb;
        std::uint16_t transfers = 0;
        for (std::size_t i = 0; i < 2; ++i) {
            registers_.EP[i].R = ep_[i];
            transfers = (ep_[i] & (EP_CTR_RX | EP_CTR_TX)) != 0 ? ISTR_CTR : transfers;
        }
        registers_.ISTR = static_cast<std::uint16_t>(flags | transfers);
        port_.on_interrupt();
        EXPECT_EQ(registers_.ISTR & flags, 0) << "flags are cleared by writing 0";
        for (std::size_t i = 0; i < 2; ++i) {
            if (registers_.EP[i].R != ep_[i]) {
                ep_[i] = after_write(ep_[i], registers_.EP[i].R);
            }
            EXPECT_EQ(ep_[i] & (EP_CTR_RX | EP_CTR_TX), 0) << "every transfer is served at once";
        }
    }

    void reset() {
        ep_ = {};
        registers_.DADDR = 0;
        in_toggle_ = out_toggle_ = 0;
        interrupt(stm32g4::usb::ISTR_RESET);
    }

    void setup(const std::array<std::uint8_t, 8>& bytes) {
        using namespace stm32g4::usb;
        put(0, {bytes.begin(), bytes.end()});
        ep_[0] = static_cast<std::uint16_t>((ep_[0] & ~(EP_STAT_RX | EP_STAT_TX)) | EP_CTR_RX | EP_SETUP | EP_DTOG_RX |
                                            EP_DTOG_TX | 0x2020);
        interrupt();
    }

    Handshake out(std::size_t endpoint, const Bytes& bytes) {
        using namespace stm32g4::usb;
        std::uint16_t& ep = ep_[endpoint];
        const Handshake answer = handshake((ep & EP_STAT_RX) >> EP_STAT_RX_Pos);
        if (answer == Handshake::ack) {
            put(endpoint, bytes);
            if (endpoint == 1) {
                EXPECT_EQ((ep & EP_DTOG_RX) != 0, out_toggle_ == 1) << "the data toggle";
                out_toggle_ ^= 1;
            }
            ep = static_cast<std::uint16_t>(((ep & ~(EP_STAT_RX | EP_SETUP)) ^ EP_DTOG_RX) | EP_CTR_RX | 0x2000);
            interrupt();
        }
        return answer;
    }

    Handshake in(std::size_t endpoint, Bytes& bytes, bool served = true) {
        using namespace stm32g4::usb;
        std::uint16_t& ep = ep_[endpoint];
        const Handshake answer = handshake((ep & EP_STAT_TX) >> EP_STAT_TX_Pos);
        bytes.clear();
        if (answer == Handshake::ack) {
            const stm32g4::UsbBufferEntry& entry = memory_.entries[endpoint];
            EXPECT_LE(entry.COUNT_TX, 64);
            for (std::size_t i = 0; i < entry.COUNT_TX; ++i) {
                bytes.push_back(static_cast<std::uint8_t>(memory_.half_words[(entry.ADDR_TX + i) / 2] >> 8 * (i % 2)));
            }
            if (endpoint == 1) {
                EXPECT_EQ((ep & EP_DTOG_TX) != 0, in_toggle_ == 1) << "the data toggle";
                in_toggle_ ^= 1;
            }
            ep = static_cast<std::uint16_t>(((ep & ~EP_STAT_TX) ^ EP_DTOG_TX) | EP_CTR_TX | 0x0020);
            if (served) {
                interrupt();
            }
        }
        return answer;
    }

    /// A complete control read; empty if the device stalls.
    std::optional<Bytes> control_in(const std::array<std::uint8_t, 8>& bytes) {
        setup(bytes);
        const std::size_t length = bytes[6] | bytes[7] << 8U;
        Bytes data;
        Bytes packet;
        do {
            if (in(0, packet) != Handshake::ack) {
                return {};
            }
            data.insert(data.end(), packet.begin(), packet.end());
        } while (packet.size() == 64 && data.size() < length);
        EXPECT_EQ(out(0, {}), Handshake::ack) << "status";
        return data;
    }

    /// A complete control request without data; false if the device stalls.
    bool control_out(const std::array<std::uint8_t, 8>& bytes) {
        setup(bytes);
        Bytes packet;
        const bool done = in(0, packet) == Handshake::ack;
        EXPECT_TRUE(packet.empty()) << "status";
        return done;
    }

    /// Enumerates the device as a host does after plug-in.
    void enumerate(std::uint8_t address = 5) {
        reset();
        EXPECT_TRUE(control_in({0x80, 6, 0, 1, 0, 0, 64, 0}).has_value());
        reset();
        EXPECT_TRUE(control_out({0, 5, address, 0, 0, 0, 0, 0}));
        EXPECT_EQ(registers_.DADDR, stm32g4::usb::DADDR_EF | address);
        EXPECT_TRUE(control_out({0, 9, 1, 0, 0, 0, 0, 0}));
    }

    /// Restarts with DATA0, as a host does after it clears a halt or selects a configuration or an interface.
    void forget_toggles() { in_toggle_ = out_toggle_ = 0; }
    [[nodiscard]] std::uint16_t endpoint(std::size_t i) const { return ep_[i]; }

private:
    static Handshake handshake(unsigned state) {
        constexpr std::array kAnswers{Handshake::none, Handshake::stall, Handshake::nak, Handshake::ack};
        return kAnswers[state];
    }

    void put(std::size_t endpoint, const Bytes& bytes) {
        stm32g4::UsbBufferEntry& entry = memory_.entries[endpoint];
        EXPECT_EQ(entry.COUNT_RX & 0xFC00, 0x8400) << "64 bytes of room";
        for (std::size_t i = 0; i < bytes.size(); ++i) {
            volatile std::uint16_t& two = memory_.half_words[(entry.ADDR_RX + i) / 2];
            two = static_cast<std::uint16_t>(i % 2 == 0 ? bytes[i] : (two & 0xFF) | bytes[i] << 8U);
        }
        entry.COUNT_RX = static_cast<std::uint16_t>((entry.COUNT_RX & 0xFC00) | bytes.size());
    }

    stm32g4::UsbRegisters& registers_;
    stm32g4::UsbPacketMemory& memory_;
    Port& port_;
    std::array<std::uint16_t, 2> ep_{};
    unsigned in_toggle_ = 0;
    unsigned out_toggle_ = 0;
};

}  // namespace tricoil::test
