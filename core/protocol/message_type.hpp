// Message types and the numbers of their enumerations on the wire. New entries get new numbers; old numbers are never reused.
#pragma once

#include <cstdint>

namespace tricoil::protocol {

/// Protocol versions of this code. The version is the first byte of every message. Since version 3 a column has levels and the
/// gain step. An addition keeps the version if an older peer never receives it unasked: a command that
/// an older device answers by `unknown`, and the message that answers it.
constexpr std::uint8_t kOldestVersion = 3;
constexpr std::uint8_t kNewestVersion = 3;

/// In order of priority on a bus. 7 and 8 were used in the past.
enum class MessageType : std::uint8_t {
    command = 1,
    ack = 2,
    status = 3,
    column = 4,
    pose = 5,
    identify = 6,
    check = 9,
    raw_block = 10,
    calibration = 11,
    condition = 12,
    parameters = 13,
};
constexpr std::uint8_t kMaxMessageType = 13;

/// front_end: measures; the host tracks. tracker: tracks on the device.
enum class Role : std::uint8_t { front_end = 1, tracker = 2 };

enum class Opcode : std::uint8_t {
    hello = 1,              // argument: oldest version, newest version << 8; answered by identify
    start = 2,              // start measuring
    stop = 3,               // switch the coils off and end the session
    excite = 4,             // the host has switched the coils: `state`, argument: its state sequence
    keep_alive = 5,         // resets the device's watchdog; argument: sequence of the newest received column or pose
    read_calibration = 6,   // answered by calibration
    write_calibration = 7,  // stores the calibration message that was sent before
    self_check = 8,         // answered by check messages
    read_block = 9,         // excite `state` for one block; answered by its raw_block messages
    mode = 10,              // acquisition mode from the next start; argument: mode_argument()
    hemisphere = 11,        // present half space of the sensor; argument: hemisphere_argument()
    boresight = 12,         // argument 1: the present attitude reads as zero from now on; 0: removes that correction
    loader = 13,            // restart in the manufacturer's boot loader for a firmware update; argument: kLoaderKey
    read_condition = 14,    // answered by condition
    read_parameters = 15,   // answered by parameters
    save_parameters = 16,   // keeps the present parameters without power
    set_parameter = 64,     // until power-off; this opcode plus the place of the parameter; argument: its value
};
constexpr std::uint8_t kOpcodes = 16;  // without set_parameter

/// Argument of `loader`, a guard against accidental commands.
constexpr std::uint32_t kLoaderKey = 0x4C4F4144;
constexpr std::uint32_t kImageKey = 0x494D4147;  // restarts in the image that was written

/// Argument of an acknowledgement with `refused`: why.
enum class Refusal : std::uint8_t {
    unsupported = 0,    // the device does not do this
    no_permission = 1,  // a person must first press the button of the device
};

/// Result of a command. refused: see Refusal.
enum class AckResult : std::uint8_t {
    done = 0,
    refused = 1,
    unknown = 2,      // no such command
    busy = 3,         // try again later
    failed = 4,       // the operation failed
    bad_value = 5,    // an argument is out of range
    wrong_state = 6,  // not allowed in this device state, or before hello
    replayed = 7,     // repeated sequence number
    unreadable = 8,   // damaged command: opcode 0; argument: the WireError
};

enum class DeviceState : std::uint8_t { idle = 0, running = 1, fault = 2 };

/// Fault bits of a status message. Some stay set until the next start, others as long as the fault is present.
enum class Fault : std::uint16_t {
    watchdog = 1U << 0U,       // no command from the host in time: coils are off
    overcurrent = 1U << 1U,    // the power stages have shut down because of over-current
    converter = 1U << 2U,      // samples were lost, or an amplifier is defective
    calibration = 1U << 3U,    // missing, damaged or not usable
    temperature = 1U << 4U,    // out of limits
    supply = 1U << 5U,         // out of limits
    transition = 1U << 6U,     // the excitation state changed within a window
    send_overflow = 1U << 7U,  // messages were dropped before they were sent
    open_coil = 1U << 8U,      // no reference current although a coil is driven
    self_check = 1U << 9U,     // a self-check row failed, or program or data memory is damaged
    hung = 1U << 10U,          // the processor was reset by the watchdog or after a program fault
    clock = 1U << 11U,         // the crystal does not run: rates are inaccurate
    stack = 1U << 12U,         // the stack is nearly full
    memory = 1U << 13U,        // the calibration memory cannot be written
    drive = 1U << 14U,         // the power stages do not follow commands
};

/// Set of faults, with the bits of the status message.
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
