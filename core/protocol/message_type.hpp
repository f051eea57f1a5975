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
    mode = 10,              // how it measures from the next start on; argument: mode_argument()
    hemisphere = 11,        // where the sensor is now; argument: hemisphere_argument()
    boresight = 12,         // argument 1: the present attitude reads as straight ahead from now on; 0: forget that
    loader = 13,            // begin again in the manufacturer's loader, for new firmware; argument: kLoaderKey
};
constexpr std::uint8_t kOpcodes = 13;

/// Argument of `loader`: nobody says it by chance.
constexpr std::uint32_t kLoaderKey = 0x4C4F4144;

/// What became of a command. refused: not by this device.
enum class AckResult : std::uint8_t {
    done = 0,
    refused = 1,
    unknown = 2,      // no such command
    busy = 3,         // later
    failed = 4,       // tried in vain
    bad_value = 5,    // an argument outside its range
    wrong_state = 6,  // not while it measures, not while it does not, or not before hello
    replayed = 7,     // a sequence number that has been before
    unreadable = 8,   // damaged: opcode 0; argument: the WireError
};

enum class DeviceState : std::uint8_t { idle = 0, running = 1, fault = 2 };

/// Bits of a status message. Some are told until the next start, some for as long as they are true.
enum class Fault : std::uint16_t {
    watchdog = 1U << 0U,       // the host fell silent: coils are off
    overcurrent = 1U << 1U,    // a power stage limits
    converter = 1U << 2U,      // samples were lost, or an amplifier is broken
    calibration = 1U << 3U,    // none, or a damaged one
    temperature = 1U << 4U,    // beyond its limits
    supply = 1U << 5U,         // beyond its limits
    transition = 1U << 6U,     // the coils changed within a window
    send_overflow = 1U << 7U,  // messages were dropped before they were sent
    open_coil = 1U << 8U,      // no reference current though a coil is driven
    self_check = 1U << 9U,     // a row of the self-check failed
    hung = 1U << 10U,          // the watchdog, or a fault of the program, has reset the processor
    clock = 1U << 11U,         // no crystal: rates are wrong
    stack = 1U << 12U,         // next to nothing of the stack is left
    memory = 1U << 13U,        // the store of the calibration does not take what is written
    drive = 1U << 14U,         // the power stages do not do what they are told
};

/// A set of faults; its bits are those of the status message.
class Faults {
public:
    constexpr void set(Fault fault) { bits_ = static_cast<std::uint16_t>(bits_ | static_cast<std::uint16_t>(fault)); }
    constexpr void clear(Fault fault) { bits_ = static_cast<std::uint16_t>(bits_ & ~static_cast<std::uint16_t>(fault)); }
    constexpr void set_to(bool is_there, Fault fault) { is_there ? set(fault) : clear(fault); }
    [[nodiscard]] constexpr bool has(Fault fault) const { return (bits_ & static_cast<std::uint16_t>(fault)) != 0; }
    [[nodiscard]] constexpr std::uint16_t bits() const { return bits_; }
    friend constexpr bool operator==(Faults, Faults) = default;

private:
    std::uint16_t bits_ = 0;
};

}  // namespace tricoil::protocol
