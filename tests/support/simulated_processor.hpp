// Watchdog, resets, status LED, button and heartbeat line of a microcontroller, in virtual time.
#pragma once

#include <cstdint>
#include <vector>

#include "hal/board_monitor.hpp"
#include "hal/heartbeat.hpp"
#include "hal/image_bank.hpp"
#include "hal/indicator.hpp"
#include "hal/push_button.hpp"
#include "hal/system_control.hpp"
#include "hal/watchdog.hpp"
#include "sim/hal/simulated_hal.hpp"

namespace tricoil::sim {

/// After one missed time-out has_expired() stays true.
class SimulatedWatchdog final : public hal::Watchdog {
public:
    explicit SimulatedWatchdog(const hal::Clock& clock) : clock_(clock) {}
    [[nodiscard]] bool is_started() const { return timeout_.count() > 0; }
    [[nodiscard]] bool has_expired() const { return expired_ || (is_started() && clock_.now() - fed_ > timeout_); }

private:
    Status do_start(Microseconds timeout) override {
        timeout_ = timeout;
        fed_ = clock_.now();
        return {};
    }
    void do_feed() override {
        expired_ = has_expired();
        fed_ = clock_.now();
    }
    const hal::Clock& clock_;
    Microseconds timeout_{0};
    DeviceTime fed_{};
    bool expired_ = false;
};

/// Sleeps one millisecond at a time; counts the restart requests.
class SimulatedSystem final : public hal::SystemControl {
public:
    explicit SimulatedSystem(SimulatedClock& clock) : clock_(clock) {}
    void set_reset_reason(hal::ResetReason reason) { reason_ = reason; }
    void set_faults(hal::SystemFaults faults) { faults_ = faults; }
    [[nodiscard]] int loader_restarts() const { return loader_restarts_; }

private:
    [[nodiscard]] hal::ResetReason do_reset_reason() const override { return reason_; }
    [[nodiscard]] hal::SystemFaults do_faults() const override { return faults_; }
    [[nodiscard]] const hal::SystemReport& do_report() const override { return report_; }
    void do_idle() override { clock_.pause(1e-3); }
    void do_restart_into_loader() override { ++loader_restarts_; }

    SimulatedClock& clock_;
    hal::ResetReason reason_ = hal::ResetReason::power_on;
    hal::SystemFaults faults_;
    hal::SystemReport report_;
    int loader_restarts_ = 0;
};

/// Takes any image whose length is in the first two bytes; a first byte of zero: for another board.
class SimulatedImageBank final : public hal::ImageBank {
public:
    std::vector<std::uint8_t> image;
    bool on_trial = false;
    bool is_worn_out = false;
    int trials = 0;
    int returns = 0;
    int confirmations = 0;

private:
    Status do_write(std::uint32_t offset, std::span<const std::uint8_t> part) override {
        if (offset == 0 && (part.size() < 2 || part[0] == 0)) {
            return {StatusCode::invalid_argument, "not an image for this board"};
        }
        image.resize(offset == 0 ? 0 : image.size());
        if (offset != image.size()) {
            return {StatusCode::not_ready, "not the next part of the image"};
        }
        if (is_worn_out) {
            return {StatusCode::device_lost, "the memory failed"};
        }
        image.insert(image.end(), part.begin(), part.end());
        return {};
    }
    [[nodiscard]] std::uint32_t do_size() const override { return static_cast<std::uint32_t>(image.size()); }
    [[nodiscard]] bool do_is_complete() const override {
        return image.size() > 2 && image.size() == static_cast<std::size_t>(image[0] | image[1] << 8U);
    }
    void do_restart(bool tries) override { ++(tries ? trials : returns); }
    [[nodiscard]] bool do_is_on_trial() const override { return on_trial; }
    Status do_confirm() override {
        ++confirmations;
        on_trial = false;
        return {};
    }
};

class SimulatedIndicator final : public hal::Indicator {
public:
    [[nodiscard]] std::uint64_t changes() const { return changes_; }

private:
    void do_show(bool lit) override {
        changes_ += lit == lit_ ? 0U : 1U;
        lit_ = lit;
    }
    bool lit_ = false;
    std::uint64_t changes_ = 0;
};

class SimulatedButton final : public hal::PushButton {
public:
    void press(bool pressed) { pressed_ = pressed; }

private:
    [[nodiscard]] bool do_is_pressed() const override { return pressed_; }
    bool pressed_ = false;
};

class SimulatedMonitor final : public hal::BoardMonitor {
public:
    hal::BoardReading reading{3300, 2500, 2500};
    bool is_hot = false;

private:
    [[nodiscard]] hal::BoardReading do_read() override { return reading; }
    [[nodiscard]] bool do_stage_is_hot() const override { return is_hot; }
};

class SimulatedHeartbeat final : public hal::Heartbeat {
public:
    [[nodiscard]] std::uint64_t beats() const { return beats_; }
    void cut() { is_cut_ = true; }

private:
    Status do_beat() override {
        ++beats_;
        return is_cut_ ? Status{StatusCode::device_lost, "the line is gone"} : Status{};
    }
    std::uint64_t beats_ = 0;
    bool is_cut_ = false;
};

}  // namespace tricoil::sim
