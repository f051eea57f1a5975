// Tracker board without hardware: the firmware application, a simulated world, and three links, each with a host.
#pragma once

#include <functional>
#include <memory>
#include <numbers>

#include "board/app/tracker_device.hpp"
#include "board/support/sim_input/scenario_file.hpp"
#include "core/signal/stated_plan.hpp"
#include "sim/world/scenario.hpp"
#include "tests/app/host_end.hpp"
#include "tests/support/simulated_processor.hpp"
#include "tests/support/single_precision.hpp"
#include "tests/support/storage/simulated_storage.hpp"

namespace tricoil::test {

/// A sampler that passes a copy of every block to a function, which may change it.
class TamperedSampler final : public hal::CoilSampler {
public:
    explicit TamperedSampler(hal::CoilSampler& sampler) : sampler_(sampler) {}
    /// Called with each block and its samples; returns the result of poll().
    std::function<Status(SampleBlock&, std::vector<Sample>&)> tamper;
    std::uint64_t polls = 0;
    std::function<Status()> started;

private:
    Status do_start(const signal::AcquisitionPlan& plan) override {
        const Status begun = started ? started() : Status{};
        return begun.ok() ? sampler_.start(plan) : begun;
    }
    Status do_poll(SampleBlock& block) override {
        ++polls;
        const Status status = sampler_.poll(block);
        if (!status.ok() || !tamper) {
            return status;
        }
        samples_.assign(block.samples.begin(), block.samples.end());
        const Status tampered = tamper(block, samples_);
        block.samples = samples_;
        return tampered;
    }
    void do_stop() override { sampler_.stop(); }

    hal::CoilSampler& sampler_;
    std::vector<Sample> samples_;
};

inline const std::array<signal::AcquisitionPlan, 4> kBenchModes{
    signal::stated_tdm_plan(144e3, 200, 40, 12), signal::stated_fdm_plan(144e3, 600, {32, 42, 56}),
    signal::stated_fdm_plan(144e3, 150, {8, 10, 14}), signal::stated_dual_band_plan(144e3, 600, {32, 42, 56}, {2, 3, 4})};

struct BenchParams {
    std::string scenario = "hand";
    signal::GainSteps<double> gains{};
    std::uint8_t gain_steps = 1;
    int converter_bits = 24;
    Microseconds host_silence{250'000};
    hal::ResetReason reset = hal::ResetReason::power_on;
    Mat3<double> source = Mat3<double>::Identity();  // axes of the source coils
    bool measures_supply = true;                     // which pauses the measurement once a second
};

/// Board, simulated world and hosts. The world and the flash survive boot().
struct DeviceBench {
    static constexpr std::size_t kLinks = 3;

    explicit DeviceBench(const BenchParams& p = {})
        : bench(p),
          scenario(host::load_scenario(p.scenario, 1)),
          world(world_of(scenario, p), *scenario.motion, scenario.faults),
          gain(p.gains, p.gain_steps),
          sampler(world, coils, clock, 1e9) {
        world.configure(kBenchModes[0]);
        sampler.amplify(gain);
        for (std::size_t n = 0; n < kLinks; ++n) {
            ports[n] = &device_ends[n];
            hosts.push_back(std::make_unique<HostEnd>(device_ends[n]));
        }
        system.set_reset_reason(p.reset);
        boot();
    }

    static sim::WorldParams world_of(sim::Scenario& scenario, const BenchParams& p) {
        scenario.world.converter.bits = p.converter_bits;
        scenario.world.source_matrix = p.source;
        return scenario.world;
    }

    [[nodiscard]] app::DeviceParams params() {
        app::DeviceParams p;
        p.serial = 42;
        p.firmware = 0x000100;
        p.demodulator = sim::in_single(world.demodulation());
        for (std::size_t n = 0; n < bench.gain_steps; ++n) {  // nominal values; the board measures the real ones
            p.demodulator.gain_steps[n].gain.fill(std::pow(4.0F, static_cast<float>(n)));
        }
        for (std::size_t n = 0; n < modes.size(); ++n) {
            world.configure(kBenchModes[n]);
            modes[n] = {kBenchModes[n], sim::in_single(world.demodulation()).response};
        }
        world.configure(kBenchModes[0]);
        p.modes = modes;
        p.coupling_constant_m3 = static_cast<float>(scenario.world.coupling_constant_m3);
        p.hemisphere = scenario.motion->at(0).position_m.cast<float>();
        p.most_reference_v = 2.45F;  // the simulated reference is 1 V in TDM, 2.4 V in two bands
        p.host_silence = bench.host_silence;
        p.has_monitor = bench.measures_supply;
        return p;
    }

    /// Restarts from reset. The content of the storage is kept.
    void boot() {
        device.emplace(app::DeviceHardware{clock, coils, tampered, gain, heartbeat, storage, image, watchdog, system, indicator,
                                           button, monitor, ports},
                       params());
        device->boot();
    }

    HostEnd& host(std::size_t n = 0) { return *hosts[n]; }

    /// Runs for `seconds` of device time. All hosts receive; those in fed_hosts send keep-alive commands.
    void run(double seconds) {
        const double end = clock.elapsed_s() + seconds;
        double fed = clock.elapsed_s();
        while (clock.elapsed_s() < end) {
            device->step();
            const bool feeds = clock.elapsed_s() - fed > 0.02;
            fed = feeds ? clock.elapsed_s() : fed;
            for (std::size_t n = 0; n < kLinks; ++n) {
                if (feeds && fed_hosts[n]) {
                    hosts[n]->keep_alive();
                }
                hosts[n]->listen();
            }
            EXPECT_FALSE(coils.state() != Excitation::off && device->state() != protocol::DeviceState::running)
                << "coils are on, but the device is not running";
        }
    }

    /// Sends `opcode` and returns its result.
    std::optional<protocol::AckResult> ask(protocol::Opcode opcode, std::uint32_t argument = 0,
                                           Excitation state = Excitation::off, std::size_t n = 0) {
        host(n).command(opcode, argument, state);
        run(0.01);
        return host(n).result();
    }

    /// Presses the button for a tenth of a second.
    void press_button() {
        button.press(false);
        run(0.05);
        button.press(true);
        run(0.1);
        button.press(false);
        run(0.05);
    }

    /// Presses the button, then sends a calibration on the first link.
    void write(std::span<const std::uint8_t> blob) {
        press_button();
        host().write(blob);
        run(0.01);
    }

    /// Opens the links, sends hello and start, and enables keep-alive commands.
    void track(std::size_t links = 1) {
        run(0.01);
        for (std::size_t n = 0; n < links; ++n) {
            host(n).hello();
            host(n).start();
            fed_hosts[n] = true;
        }
        run(0.01);
    }

    BenchParams bench;
    std::array<app::MeasuringMode, kBenchModes.size()> modes{};
    sim::Scenario scenario;
    sim::SimulatedClock clock;
    sim::CoilWorld world;
    sim::SimulatedCoilDriver coils;
    sim::SimulatedGain gain;
    sim::SimulatedCoilSampler sampler;
    TamperedSampler tampered{sampler};
    sim::SimulatedStorage storage{4, 2048};
    sim::SimulatedImageBank image;
    sim::SimulatedWatchdog watchdog{clock};
    sim::SimulatedSystem system{clock};
    sim::SimulatedIndicator indicator;
    sim::SimulatedButton button;
    sim::SimulatedMonitor monitor;
    sim::SimulatedHeartbeat heartbeat;
    std::array<sim::MemoryPort, kLinks> device_ends;
    std::array<hal::MessagePort*, kLinks> ports{};
    std::vector<std::unique_ptr<HostEnd>> hosts;
    std::array<bool, kLinks> fed_hosts{};
    std::optional<app::TrackerDevice> device;
};

}  // namespace tricoil::test
