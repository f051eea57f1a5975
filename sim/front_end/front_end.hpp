// Simulated front end on a link.
#pragma once

#include <deque>
#include <functional>
#include <memory>
#include <optional>
#include <vector>

#include "core/protocol/codec.hpp"
#include "core/signal/demodulator.hpp"
#include "core/tracking/tracker_params.hpp"
#include "hal/message_port.hpp"
#include "sim/front_end/peer_fault.hpp"
#include "sim/hal/simulated_hal.hpp"
#include "sim/world/scenario.hpp"

namespace tricoil::sim {

enum class Pace : std::uint8_t { real, lockstep };

struct FrontEndParams {
    std::shared_ptr<const Scenario> scenario;  // required
    signal::Multiplexing multiplexing = signal::Multiplexing::tdm;
    double frame_rate_hz = 240;
    double duration_s = 10;  // of the measurement, simulated time
    Pace pace = Pace::lockstep;
    std::uint32_t ahead = 64;            // lockstep: no slot starts while this many columns are not acknowledged
    std::int64_t patience_us = 100'000;  // a slot starts after this time even if the host is not ready
    std::uint64_t serial = 1;
    std::uint32_t watchdog_us = 100'000;
    std::vector<PeerFault> faults;

    /// Reads the excitation state from the host's lines; empty: the front end drives the coils.
    std::function<Excitation()> sense_coils;
    /// Called at the end of a window, before its columns are sent (sync line); empty: no sync line.
    std::function<void()> window_over;
    /// Calibration blob; empty: none.
    std::vector<std::uint8_t> calibration;
    bool fails_self_check = false;  // the last row fails
    /// Refuses loader and calibration commands like a board whose button nobody presses. Otherwise they are permitted: a
    /// simulated device has nothing to protect.
    bool is_locked = false;
};

struct FrontEndCounters {
    std::uint64_t slots = 0;
    std::uint64_t sent = 0;
    std::uint64_t unsent = 0;       // the link had no room
    std::uint64_t transitions = 0;  // windows in which the excitation state was not the commanded one
    std::uint64_t watchdogs = 0;    // times that the watchdog expired
    std::uint64_t starts = 0;
    std::int64_t longest_silence_us = 0;  // of the host, until the coils were off
};

/// Measures columns of a simulated world, for the front end and for tests that compute the expected columns.
class ColumnSource {
public:
    ColumnSource(const FrontEndParams& params);

    /// Samples the next slot. The samples are valid until the next call. Empty if a simulated fault loses the slot.
    std::optional<SampleBlock> sample(Excitation state);

    /// Measures the next slot. Returns one column (TDM), three (FDM), or none if a simulated fault loses the slot.
    signal::Columns<double> measure(Excitation state);

    [[nodiscard]] const signal::AcquisitionPlan& plan() const { return plan_; }
    [[nodiscard]] double elapsed_s() const { return clock_.elapsed_s(); }
    [[nodiscard]] const Scenario& scenario() const { return *scenario_; }
    [[nodiscard]] tracking::TrackerParams<double> tracker_params() const;

private:
    std::shared_ptr<const Scenario> scenario_;
    signal::AcquisitionPlan plan_;
    CoilWorld world_;
    signal::Demodulator<double> demodulator_;
    SimulatedCoilDriver coils_;
    SimulatedClock clock_;
    SimulatedCoilSampler sampler_;
};

class SimulatedFrontEnd {
public:
    SimulatedFrontEnd(hal::MessagePort& port, FrontEndParams params);

    /// Serves the link, and measures a slot if one is due. `now`: monotonic clock of this computer. Waits at most one
    /// millisecond.
    void step(HostTime now);

    [[nodiscard]] bool finished() const { return finished_; }
    [[nodiscard]] bool coils_on() const { return running_; }
    [[nodiscard]] const FrontEndCounters& counters() const { return counters_; }
    [[nodiscard]] const std::vector<std::uint8_t>& calibration() const { return params_.calibration; }

private:
    void serve(HostTime now);
    void dispatch_command(const protocol::CommandMessage& command, HostTime now);
    [[nodiscard]] protocol::AckResult answer(const protocol::CommandMessage& command);
    void answer_self_check();
    void answer_block(const SampleBlock& block);
    void send_waiting();
    [[nodiscard]] protocol::AckResult set_mode(std::uint32_t argument);
    [[nodiscard]] protocol::AckResult enter_loader(std::uint32_t argument);
    void keep_calibration(const protocol::CalibrationMessage& message);
    void acknowledge(protocol::Opcode opcode, std::uint16_t request, protocol::AckResult result,
                     protocol::Refusal refusal = protocol::Refusal::unsupported);
    void start(HostTime now);
    void stop();
    [[nodiscard]] bool slot_is_due(HostTime now) const;
    void run_slot();
    void send_column(const MeasuredColumn<double>& column, bool transition);
    void send_data(std::vector<std::uint8_t> bytes, std::uint32_t number);
    void send_identity(std::uint64_t serial);
    void send_status(HostTime now);
    template <typename Message>
    std::vector<std::uint8_t> stamped(Message message);
    bool transmit(std::span<const std::uint8_t> bytes);
    [[nodiscard]] std::optional<PeerFaultKind> fault_at(std::uint32_t number) const;

    hal::MessagePort& port_;
    FrontEndParams params_;
    std::unique_ptr<ColumnSource> source_;
    std::unique_ptr<ColumnSource> bench_;  // separate world for raw blocks
    bool running_ = false;
    bool finished_ = false;
    bool watchdog_bit_ = false;
    bool in_loader_ = false;      // in the bootloader, which does not use this protocol
    std::uint32_t sequence_ = 0;  // of columns
    std::uint32_t other_sequence_ = 0;
    std::uint32_t acknowledged_ = 0;  // number of columns that the host acknowledged
    std::uint32_t slot_ = 0;
    std::uint32_t excited_ = 0;  // newest state sequence of the host
    Excitation excited_state_ = Excitation::off;
    HostTime begin_;
    HostTime heard_;
    HostTime slot_begin_;
    HostTime status_;
    std::vector<std::uint8_t> held_;                 // message to send after the next one
    std::deque<std::vector<std::uint8_t>> waiting_;  // answers that wait for room on the link
    std::uint32_t blocks_ = 0;                       // sent as samples
    FrontEndCounters counters_;
};

}  // namespace tricoil::sim
