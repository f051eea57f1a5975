// What messages there are, and the numbers that their fields take. Numbers go over the wire: new things get new numbers, old ones
// are never used again.
#pragma once

#include <cstdint>

namespace tricoil::protocol {

/// Version that this code speaks; the first byte of every message.
constexpr std::uint8_t kOldestVersion = 1;
constexpr std::uint8_t kNewestVersion = 1;

/// In the order of their priority on a bus.
enum class MessageType : std::uint8_t {
    command = 1,
    ack = 2,
    status = 3,
    column = 4,
    pose = 5,
    identify = 6,
    couplings = 7,
    covariance = 8,
    check = 9,
    raw_block = 10,
    calibration = 11,
};
constexpr std::uint8_t kMessageTypes = 11;

/// What a device is: it measures and leaves the tracking to the host, or tracks by itself.
enum class Role : std::uint8_t { front_end = 1, tracker = 2 };

enum class Opcode : std::uint8_t {
    hello = 1,              // argument: oldest version, newest version << 8; answered by identify
    start = 2,              // begin to measure
    stop = 3,               // coils off, end
    excite = 4,             // the host has switched the coils: `state`, argument: its state sequence
    keep_alive = 5,         // feeds the device's watchdog; argument: sequence of the newest column received
    read_calibration = 6,   // answered by calibration
    write_calibration = 7,  // acknowledges the calibration message that went before
    self_check = 8,         // answered by check messages
    read_block = 9,         // excite `state` for one block; answered by its raw_block messages
};

/// refused: not while it measures, or not by this device; busy: later; failed: tried in vain.
enum class AckResult : std::uint8_t { done = 0, refused = 1, unknown = 2, busy = 3, failed = 4 };

enum class DeviceState : std::uint8_t { idle = 0, running = 1, fault = 2 };

/// Bits of a status message.
enum class Fault : std::uint16_t {
    watchdog = 1U << 0U,      // the host fell silent: coils are off
    overcurrent = 1U << 1U,   // a power stage limits
    converter = 1U << 2U,     // samples were lost
    calibration = 1U << 3U,   // none, or a damaged one
    temperature = 1U << 4U,   // beyond its limits
    supply = 1U << 5U,        // beyond its limits
    transition = 1U << 6U,    // the coils changed within a window
    send_overflow = 1U << 7U  // messages were dropped before they were sent
};

}  // namespace tricoil::protocol
