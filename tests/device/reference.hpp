// Reference poses: the simulated front end's world, demodulator, wire format and tracker in one process.
#pragma once

#include <cstdio>
#include <memory>
#include <sstream>
#include <string>
#include <vector>

#include "board/pose_text/pose_fields.hpp"
#include "board/support/sim_input/scenario_file.hpp"
#include "core/protocol/convert.hpp"
#include "core/tracking/methods/any_tracker.hpp"
#include "sim/front_end/front_end.hpp"
#include "tests/drivers/shell.hpp"

namespace tricoil::test {

/// The front end's default scenario.
inline std::shared_ptr<const sim::Scenario> default_scenario() {
    return std::make_shared<sim::Scenario>(host::load_scenario("hand", 1));
}

/// Poses of the first `duration_s`.
inline std::vector<tracking::PoseEstimate<double>> reference_poses(sim::FrontEndParams params, double duration_s) {
    params.scenario = default_scenario();
    sim::ColumnSource source(params);
    auto tracker_params = source.tracker_params();
    tracker_params.common.hemisphere = Vec3<double>::UnitX();
    tracker_params.common.window_s = 1e-6 * static_cast<double>(std::lround(1e6 * tracker_params.common.window_s));
    if (source.plan().has_low_band()) {
        tracker_params.method = tracking::dual_band_params(source.plan().block_s());
    }
    tracking::AnyTracker tracker(tracker_params);
    std::vector<tracking::PoseEstimate<double>> poses;
    std::uint32_t number = 0;
    for (std::uint32_t slot = 0; source.elapsed_s() + source.plan().block_s() <= duration_s + 1e-9; ++slot) {
        const Excitation state = source.plan().is_tdm() ? single_coil(static_cast<int>(slot % 3)) : Excitation::all;
        for (MeasuredColumn<double> column : source.measure(state)) {
            column.state_sequence = slot + 1;
            MeasuredColumn<double> received;
            if (protocol::from_message(protocol::to_message(column, number++), received) != protocol::WireError::none) {
                continue;
            }
            if (const auto pose = tracker.update(received)) {
                poses.push_back(*pose);
            }
        }
    }
    return poses;
}

inline std::vector<std::string> lines(const std::string& text) {
    std::istringstream stream(text);
    std::vector<std::string> found;
    for (std::string line; std::getline(stream, line);) {
        found.push_back(line);
    }
    return found;
}

/// Compares the received poses with the reference: equal in every digit.
inline void expect_equal_poses(const std::string& csv, const sim::FrontEndParams& params, double duration_s,
                               std::size_t at_least) {
    std::string reference = host::pose_column_names(host::kDeviceForm) + '\n';
    for (const auto& pose : reference_poses(params, duration_s + 1)) {
        reference += host::pose_line({.pose = pose, .epoch = 0}, host::PoseFormat::csv, host::kDeviceForm);
    }
    const auto got = lines(read_text(csv));
    const auto expected = lines(reference);
    ASSERT_GE(got.size(), at_least);
    ASSERT_GE(expected.size(), got.size());
    for (std::size_t i = 0; i < got.size(); ++i) {
        ASSERT_EQ(got[i], expected[i]) << "line " << i;
    }
    std::printf("%s: %zu poses equal those of one process in every digit\n", csv.c_str(), got.size() - 1);
}

}  // namespace tricoil::test
