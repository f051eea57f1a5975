// Columns and poses of a simulated board, block by block.
#pragma once

#include <chrono>
#include <numeric>
#include <utility>

#include "board/app/main_loop.hpp"
#include "board/simulation/stations.hpp"
#include "board/stream/source.hpp"
#include "board/support/errors.hpp"
#include "core/fixed/from_double.hpp"
#include "sim/hal/simulated_hal.hpp"

namespace tricoil::host {

/// Sensors, clock and devices of a simulated board.
struct SimulatedBoard {
    /// Throws InputError, naming the option, for invalid options.
    explicit SimulatedBoard(const SimulationOptions& options)
        : setup(make_simulation(options)), stations(setup), sampler(stations.first(), coils, clock, setup.scenario.duration_s) {
        clock.begin(setup.plan.params.sample_rate_hz);
        stations.add_further(sampler);
    }

    /// Of the board's main loop with a floating-point tracker. Throws like make_tracker().
    [[nodiscard]] app::MainLoopParams<double> loop_params(const SimulationOptions& options) const {
        app::MainLoopParams<double> params{setup.plan, stations.first().demodulation(), make_tracker(options, setup)};
        params.sensors = setup.stations;
        if (setup.plan.is_tdm() && !is_by_columns(options)) {
            params.tracker.common.converter = {stations.first().coupling_step(), stations.first().noise_codes()};
        }
        return params;
    }

    /// Of a sensor, in the source frame.
    [[nodiscard]] solver::RigidPose<double> true_pose(std::size_t sensor, DeviceTime time) const {
        const sim::Pose pose = stations.motion(sensor).at(clock.elapsed_s(time));
        return {pose.position_m, pose.q_source_sensor};
    }

    const SimulationSetup setup;
    Stations stations;
    sim::SimulatedClock clock;
    sim::SimulatedCoilDriver coils;
    sim::SimulatedCoilSampler sampler;
};

/// Loop: app::BlockLoop or ColumnLoop, of this board.
template <typename Loop>
class SimulatedSource final : public Source {
public:
    /// Starts the loop. Both arguments must outlive this object. Throws DeviceError.
    SimulatedSource(SimulatedBoard& board, Loop& loop) : board_(board), loop_(loop) { expect(loop_.start()); }
    ~SimulatedSource() override { loop_.stop(); }

    /// Demodulation and tracking of one block, mean.
    [[nodiscard]] double update_us() const { return updates_ > 0 ? 1e6 * update_s_ / static_cast<double>(updates_) : 0; }

private:
    static void expect(const Status& status) {
        if (!status.ok()) {
            throw DeviceError(std::string("simulated board: ") + status.message());
        }
    }

    bool advance(Microseconds /*patience*/) override {
        if (std::exchange(rests_, false)) {
            expect(loop_.start());
        }
        const Status status = loop_.acquire();
        has_ended_ = status.code() == StatusCode::end_of_stream;
        if (has_ended_) {
            loop_.stop();
            return false;
        }
        if (status.code() != StatusCode::timed_out) {
            expect(status);
        }
        const auto begin = std::chrono::steady_clock::now();
        loop_.process();
        update_s_ += std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
        ++updates_;
        count();
        return true;
    }

    void rest() override {
        loop_.stop();
        rests_ = true;
    }

    bool set_hemisphere(std::size_t sensor, const Vec3<double>& towards) override {
        if constexpr (std::is_same_v<Loop, app::FixedLoop>) {
            return loop_.set_hemisphere(sensor, fixed::direction_from(towards)).ok();
        } else {
            return loop_.set_hemisphere(sensor, towards).ok();
        }
    }

    [[nodiscard]] Microseconds elapsed() const override { return microseconds_from_seconds(board_.clock.elapsed_s()); }
    [[nodiscard]] std::optional<LinkState> link_state() const override {
        return LinkState{counts_, board_.clock.now().since_start()};
    }
    [[nodiscard]] std::string status() const override { return has_ended_ ? "the simulation has ended" : "running"; }

    /// In columns. The integer tracker counts blocks.
    void count() {
        const std::uint64_t columns_per_block = board_.setup.plan.is_tdm() ? 1 : kSourceCoils;
        const std::uint64_t received = counts_.received;
        counts_.received = 0;
        counts_.lost = columns_per_block * loop_.counters().lost_blocks;
        counts_.refused = columns_per_block * loop_.counters().refused_blocks;
        counts_.dropped = loop_.counters().unsent_poses;
        for (std::size_t sensor = 0; sensor < static_cast<std::size_t>(board_.setup.stations); ++sensor) {
            const auto& tracker = loop_.tracker(sensor).counters();
            if constexpr (std::is_same_v<Loop, app::FixedLoop>) {
                counts_.received += columns_per_block * tracker.accepted;
            } else {
                counts_.received += tracker.accepted;
                counts_.refused = std::accumulate(tracker.rejected.begin(), tracker.rejected.end(), counts_.refused);
            }
        }
        const DeviceTime now = board_.clock.now();
        newest_ = updates_ == 1 || counts_.received != received ? now : newest_;
        counts_.age = now - newest_;
    }

    SimulatedBoard& board_;
    Loop& loop_;
    bool rests_ = false;
    bool has_ended_ = false;
    double update_s_ = 0;
    std::uint64_t updates_ = 0;
    HealthCounts counts_;
    DeviceTime newest_;  // time of the newest accepted column
};

/// A simulated board with its main loop, as a source. Gives its columns and poses to a tap, which must outlive this object.
class OwnSimulation {
public:
    OwnSimulation(const SimulationOptions& options, tracking::TrackerTap<double>& tap)
        : board_(options),
          loop_(board_.loop_params(options), {board_.clock, board_.coils, board_.sampler, link_, &tap}),
          source_(board_, loop_) {}

    [[nodiscard]] Source& source() { return source_; }
    [[nodiscard]] const SimulatedBoard& board() const { return board_; }

private:
    SimulatedBoard board_;
    sim::SimulatedLink<double> link_{[](const tracking::PoseEstimate<double>&) {}};
    app::MainLoop<double> loop_;
    SimulatedSource<app::MainLoop<double>> source_;
};

}  // namespace tricoil::host
