// Questions to a device that is left as it is: who it is, whether it is sound, its calibration, a block of its samples.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "board/linux/device_session.hpp"
#include "board/support/interrupt.hpp"
#include "core/signal/sample_block.hpp"

namespace tricoil::linux_board {

/// One burst of samples as it was put together again.
struct RawBurst {
    protocol::RawBlockMessage about;  // of the first part; its tail is empty
    std::vector<Sample> samples;
};

/// Everything throws DeviceError with one line: no answer in time, refused, two devices, or the link is gone; Interrupted at a
/// signal.
class DeviceInquiry {
public:
    /// `wait_s`: for each answer. Throws InputError for a URI that is none.
    DeviceInquiry(const std::string& uri, double wait_s);

    const protocol::IdentifyMessage& identify();

    /// All rows of the device's self-check, in order.
    std::vector<protocol::CheckMessage> self_check();

    /// The device's calibration blob as it came, not yet checked; empty: it has none.
    std::vector<std::uint8_t> read_calibration();

    /// Returns when the device says that it keeps `blob`.
    void write_calibration(const std::vector<std::uint8_t>& blob);

    /// One block with the coils in `state`.
    RawBurst read_block(Excitation state);

    /// What a device is to do or to be set to; returns when it says that it is done. `what`: for the complaint.
    void order(const char* what, protocol::Opcode opcode, std::uint32_t argument);

    /// The attitude that the sensor has now reads as straight ahead from now on. A device that does not measure is started for
    /// it, and stopped again when a pose has been valid.
    void boresight();

    /// Calls each(message) for whatever the device says, until `seconds` are over (0: never) or a signal comes; the device is
    /// greeted until it has said who it is, and then only listened to. Returns how many messages there were.
    std::uint64_t listen(double seconds, const std::function<void(const hal::ReceivedMessage&)>& each);

    /// Why there is no conversation; empty while there is one.
    [[nodiscard]] const char* detail() const { return session_.detail(); }

private:
    static constexpr std::int64_t kAskAgainUs = 1'000'000;
    using Ask = std::function<void()>;
    using Take = std::function<bool(const hal::ReceivedMessage&)>;

    bool converse(double seconds, const host::InterruptGuard& guard, const Ask& ask, const Take& is_done,
                  std::int64_t again_us = kAskAgainUs);
    void await_pose();
    void inquire(const char* what, protocol::Opcode opcode, const Ask& ask, const Take& is_answer);
    void command(protocol::Opcode opcode, Excitation state = Excitation::off, std::uint32_t argument = 0);

    std::string uri_;
    double wait_s_;
    std::unique_ptr<hal::MessagePort> port_;
    DeviceSession session_;
    std::uint32_t calibrations_ = 0;  // sent
    std::uint16_t request_;
};

}  // namespace tricoil::linux_board
