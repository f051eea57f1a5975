// Firmware application of a tracker board: self-check, links, commands, measurement, faults. Time comes only from hal::Clock and
// from the blocks.
#pragma once

#include <array>
#include <optional>

#include "board/app/answers.hpp"
#include "board/app/calibration_store.hpp"
#include "board/app/device_parts.hpp"
#include "board/app/host_link.hpp"
#include "board/app/local_permission.hpp"
#include "board/app/main_loop.hpp"
#include "board/app/supervised_sampler.hpp"
#include "core/protocol/command_arguments.hpp"
#include "core/protocol/message_type.hpp"
#include "core/selfcheck/report.hpp"

namespace tricoil::app {

/// Coils are off until a host or the parameters start the measurement, after any fault, after the last host has stopped or is
/// silent, while the calibration is written, and after destruction. All memory is part of the object; make it static.
class TrackerDevice final : hal::Link<float>, tracking::TrackerTap<float> {
public:
    /// Requires at least one mode and one port, and C > 0.
    TrackerDevice(const DeviceHardware& hardware, const DeviceParams& params);
    ~TrackerDevice() override;

    /// Starts the watchdog, reads parameters and calibration, runs the self-check, measures the gain steps, and starts if the
    /// parameters say so. Call once before step().
    void boot();

    /// One iteration: processes messages of hosts, then measures one block, or idles if no host receives the stream.
    void step();

    [[nodiscard]] protocol::DeviceState state() const;
    [[nodiscard]] protocol::Faults faults() const { return faults_; }
    [[nodiscard]] const selfcheck::Report& report() const { return report_; }
    [[nodiscard]] const protocol::ParameterValues& parameters() const { return parameters_; }
    /// Number of invalid messages and refused commands.
    [[nodiscard]] std::uint32_t refused() const { return refused_; }

private:
    // Commands of hosts: device_commands.cpp.
    void receive_messages(HostLink& link);
    void take(HostLink& link, std::span<const std::uint8_t> bytes);
    void report_unreadable(HostLink& link, protocol::WireError error);
    protocol::AckResult process_command(HostLink& link, const protocol::CommandMessage& command);
    protocol::AckResult dispatch_command(HostLink& link, const protocol::CommandMessage& command);
    [[nodiscard]] protocol::AckResult may_drive() const;
    protocol::AckResult execute_start(HostLink& link, std::uint32_t argument);
    protocol::AckResult execute_mode(std::uint32_t argument);
    protocol::AckResult execute_hemisphere(std::uint32_t argument);
    protocol::AckResult execute_boresight(std::uint32_t argument);
    protocol::AckResult execute_read_block(HostLink& link, Excitation state);
    [[nodiscard]] bool has_permission();
    protocol::AckResult execute_loader(std::uint32_t argument);
    static protocol::AckResult check_calibration(std::span<const std::uint8_t> bytes);
    protocol::AckResult store_calibration(HostLink& link, const protocol::CalibrationMessage& message);
    protocol::AckResult store_image(const protocol::CalibrationMessage& message);
    void acknowledge(HostLink& link, std::uint8_t opcode, std::uint16_t request, protocol::AckResult result,
                     std::uint32_t argument);
    void answer_hello(HostLink& link, const protocol::CommandMessage& command);
    void send_condition(HostLink& link, std::uint16_t request);
    void send_parameters(HostLink& link, std::uint16_t request);
    bool store(CalibrationStore& to, const calibration::Blob& blob);

    // Parameters: device_parameters.cpp.
    void read_parameters();
    [[nodiscard]] bool is_usable(std::size_t place, std::uint32_t value) const;
    protocol::AckResult set_parameter(std::size_t place, std::uint32_t value);
    protocol::AckResult save_parameters();

    // Measurement: tracker_device.cpp.
    Status measure_gain();
    Status begin();
    void end();
    void fail(protocol::Fault fault);
    static protocol::Fault fault_of_start(const Status& status);
    [[nodiscard]] protocol::Fault fault_of(const Status& status) const;
    void measure();
    void start_alone();
    void confirm_image();
    void check_hosts();
    void check_processor();
    static Result<calibration::CoilCorrection<float>> usable(const calibration::Calibration<float>& c);
    void assume_nominal();
    bool use_stored();
    void use_calibration();
    void run_self_check();
    void read_monitor();
    [[nodiscard]] std::optional<protocol::Fault> fault_of_board() const;
    bool pause_for_reading();
    void report_status();
    [[nodiscard]] bool is_streaming() const;
    [[nodiscard]] const signal::AcquisitionPlan& plan() const { return params_.modes[mode_].plan; }
    [[nodiscard]] std::span<HostLink> links() { return std::span(links_).first(hardware_.ports.size()); }
    [[nodiscard]] std::span<const HostLink> links() const { return std::span(links_).first(hardware_.ports.size()); }

    template <typename Message>
    bool send(HostLink& link, Message message);
    template <typename Message>
    void stream(const Message& message);

    // hal::Link and tracking::TrackerTap: output of the loop.
    Status do_send(const tracking::PoseEstimate<float>& estimate) override;
    void do_column(const MeasuredColumn<float>& column) override;

    DeviceHardware hardware_;
    DeviceParams params_;
    std::array<std::uint8_t, kMaxBoardMessage> buffer_{};
    std::array<HostLink, kMaxPorts> links_;
    Answers answers_{buffer_};
    SupervisedSampler sampler_;
    std::optional<BoardLoop> loop_;
    bool is_measuring_ = false;
    bool knows_gain_ = false;  // gain steps were measured

    std::size_t mode_ = 0;
    bool sends_columns_ = false;
    Vec3<float> hemisphere_;                           // of the board or its calibration
    std::optional<Vec3<float>> commanded_hemisphere_;  // by a host, until the measurement ends
    Quat<float> boresight_ = Quat<float>::Identity();  // from boresight axes to sensor axes
    std::optional<Quat<float>> attitude_;              // of the newest pose, if it was valid

    CalibrationStore parameter_store_;
    protocol::ParameterValues parameters_{};
    protocol::ParameterOrigin origin_{};
    bool has_calibrated_hemisphere_ = false;

    CalibrationStore store_;
    CalibrationStore::Content stored_ = CalibrationStore::Content::none;
    std::optional<calibration::CoilCorrection<float>> coils_;
    selfcheck::Report report_;

    protocol::Faults faults_;
    bool has_failed_ = false;    // until the next start
    bool no_reference_ = false;  // in the newest block
    int stuck_blocks_ = 0;       // consecutive
    std::uint32_t refused_ = 0;
    std::uint32_t columns_ = 0;   // column messages sent
    std::uint32_t messages_ = 0;  // other messages sent
    DeviceTime now_{};
    hal::BoardReading reading_;
    DeviceTime last_reading_{};
    DeviceTime last_status_{};              // time of the last status message
    std::uint32_t last_status_faults_ = 0;  // faults and device state of the last status message
    DeviceTime not_before_{};               // earliest time at which a coil may be driven
    LocalPermission permission_;
    protocol::Refusal refusal_ = protocol::Refusal::unsupported;  // of the command in execution
    std::optional<DeviceTime> loader_at_;
    bool loads_image_ = false;         // at that time, instead of the loader
    std::uint16_t image_request_ = 0;  // of the newest part
};

}  // namespace tricoil::app
