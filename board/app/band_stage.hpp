// Correction by a second band, between demodulator and tracker. Only for programs, which compute in double.
#pragma once

#include <optional>

#include "core/tracking/dual_band/two_bands.hpp"

namespace tricoil::app {

/// In float: none.
template <typename Scalar>
class BandStage {
public:
    struct Params {};

    explicit BandStage(const Params&) {}
    void correct(const SampleBlock&, signal::Columns<Scalar>&) {}
    void finish(tracking::PoseEstimate<Scalar>&) const {}
};

template <>
class BandStage<double> {
public:
    using Params = std::optional<tracking::TwoBandParams>;  // empty: one band

    explicit BandStage(const Params& params) {
        if (params) {
            bands_.emplace(*params);
        }
    }
    void correct(const SampleBlock& block, signal::Columns<double>& columns) {
        if (bands_) {
            bands_->correct(block, columns);
        }
    }
    void finish(tracking::PoseEstimate<double>& estimate) const {
        if (bands_) {
            bands_->correction().finish(estimate);
        }
    }

private:
    std::optional<tracking::TwoBands> bands_;
};

}  // namespace tricoil::app
