// Levels of the channels of a sensor, from its columns.
#pragma once

#include <array>
#include <cmath>
#include <utility>

#include "board/support/json_text.hpp"
#include "core/protocol/convert.hpp"

namespace tricoil::host {

class LevelMeter {
public:
    void take(const protocol::ColumnMessage& m) {
        MeasuredColumn<double> column;
        if (protocol::from_message(m, column) == protocol::WireError::none) {
            take(column);
        }
    }
    void take(const MeasuredColumn<double>& column) {
        if (column.flags.has(ColumnFlag::low_band) || coil_index(column.state) < 0) {
            return;
        }
        Coil& coil = coils_[static_cast<std::size_t>(coil_index(column.state))];
        const bool is_third = coil.columns > 1;
        const Vec3<double> bend = is_third ? Vec3<double>(column.in_phase - 2 * coil.last + coil.before) : Vec3<double>::Zero();
        ++coil.columns;
        coil.gain_step = column.gain_step;
        coil.saturated += column.flags.has(ColumnFlag::saturated) || column.flags.has(ColumnFlag::clipped) ? 1 : 0;
        coil.without_reference += column.flags.has(ColumnFlag::no_reference) ? 1 : 0;
        coil.coupling += column.in_phase;
        coil.before = std::exchange(coil.last, column.in_phase);
        for (Index i = 0; i < 3; ++i) {
            coil.level(i) += column.level[static_cast<std::size_t>(i)] / 65536.0;
            coil.squares(i) += bend(i) * bend(i);
        }
    }

    /// Of source coil 0 to 2 since the last call, by sensor channel: mean coupling; mean level, of full scale (0: unknown);
    /// noise, the standard deviation from second differences, which contain no slow motion; SNR of the mean; NaN, in JSON null,
    /// below three columns. saturated, without_reference: numbers of columns.
    Json take_row(std::size_t number) {
        const Coil coil = std::exchange(coils_[number], {});
        const double n = std::max(coil.columns, 1);
        Json row = {{"coil", number + 1},
                    {"columns", coil.columns},
                    {"gain_step", coil.gain_step},
                    {"saturated", coil.saturated},
                    {"without_reference", coil.without_reference},
                    {"coupling", list_of(coil.coupling / n)},
                    {"level", list_of(coil.level / n)}};
        for (Index i = 0; i < 3; ++i) {
            const double noise = coil.columns < 3 ? std::nan("") : std::sqrt(coil.squares(i) / (6 * (n - 2)));
            row["noise"].push_back(noise);
            row["snr_db"].push_back(noise > 0 ? 20 * std::log10(std::abs(coil.coupling(i)) / n / noise) : std::nan(""));
        }
        return row;
    }

private:
    struct Coil {
        int columns = 0;
        int saturated = 0;
        int without_reference = 0;
        int gain_step = 0;
        Vec3<double> coupling = Vec3<double>::Zero();  // sums
        Vec3<double> level = Vec3<double>::Zero();
        Vec3<double> squares = Vec3<double>::Zero();  // of the second differences
        Vec3<double> last = Vec3<double>::Zero();
        Vec3<double> before = Vec3<double>::Zero();
    };
    std::array<Coil, 3> coils_;
};

}  // namespace tricoil::host
