// Both bands of one sensor: low-band demodulator and correction of the high band's columns.
#pragma once

#include <optional>

#include "core/tracking/dual_band/band_correction.hpp"

namespace tricoil::tracking {

struct TwoBandParams {
    signal::AcquisitionPlan high;
    signal::LowBandParams low;
    BandCorrectionParams correction;
};

class TwoBands {
public:
    explicit TwoBands(const TwoBandParams& params) : demodulator_(params.high, params.low), correction_(params.correction) {}

    /// Corrects the columns of one block.
    void correct(const SampleBlock& block, signal::Columns<double>& columns) {
        correction_.correct(columns, demodulator_.add(block, !columns[0].flags.has_any(kUnusableFlags)));
    }
    [[nodiscard]] const BandCorrection& correction() const { return correction_; }

private:
    signal::LowBandDemodulator demodulator_;
    BandCorrection correction_;
};

}  // namespace tricoil::tracking
