// Couplings in text files.
#pragma once

#include <array>
#include <cstddef>
#include <optional>
#include <string>
#include <string_view>

#include "board/support/table.hpp"
#include "board/support/wiring_file.hpp"
#include "core/linear/matrix.hpp"
#include "core/signal/excitation.hpp"

namespace tricoil::host {

/// Header of a CSV file of couplings at known poses; xij: sensor coil i, source coil j.
constexpr std::string_view kPoseCsvHeader = "x_m,y_m,z_m,qw,qx,qy,qz,x11,x12,x13,x21,x22,x23,x31,x32,x33";

/// Quadratures of the couplings, which may follow them in a CSV header, in the same order. Begins with a comma.
constexpr std::string_view kQuadratureColumns = ",q11,q12,q13,q21,q22,q23,q31,q32,q33";

/// Nine fields (i, j), row by row: ten digits, separated by commas.
std::string matrix_text(const Mat3<double>& matrix);

/// Levels at the converters and gain step of a pose.
struct SignalLevels {
    Mat3<double> share;  // (i, j): amplitude of source coil j in the converter of sensor channel i, of full scale; 0: unknown
    int gain_step = 0;
    std::array<Index, kSensorCoils> channel{0, 1, 2};  // of each sensor coil: the errors of a converter are those of a channel

    /// False in FDM, if the gain changed during the rest, or if the board or the host has corrected the converters.
    [[nodiscard]] bool known() const { return share.minCoeff() > 0; }
};

/// Couplings of a sensor in an unknown pose.
struct CouplingFrame {
    Mat3<double> x;                                         // in phase
    std::optional<Mat3<double>> quadrature = std::nullopt;  // if the file has it
    std::optional<SignalLevels> levels = std::nullopt;      // if the file has them

    /// From the couplings of channels to those of coils.
    void rewire(const ChannelWiring& wiring);
    [[nodiscard]] bool has_known_levels() const { return levels && levels->known(); }
};

/// Columns of the nine elements of a matrix, row by row. `form`: of their names, {0} row, {1} column. Throws like Table::column.
std::array<std::size_t, kCouplings> matrix_columns(const Table& table, std::string_view form, std::string_view expected);
Mat3<double> matrix_of(const Table& table, const std::array<std::size_t, kCouplings>& columns);

/// Couplings in a table: x11 to x33 (or m11 to m33) and, if their first is there, all quadratures and levels; in any order.
class CouplingColumns {
public:
    /// Throws InputError for a missing or repeated column, and for a wiring of couplings that are of coils already.
    explicit CouplingColumns(const Table& table, const ChannelWiring& wiring = {});

    [[nodiscard]] static bool in(const Table& table) { return table.has("x11") || table.has("m11"); }

    /// Of this row. Throws InputError, naming the place, for a cell that is not a finite number, a level that is not 0 to 1, a
    /// gain step that does not exist, and like check_couplings.
    [[nodiscard]] CouplingFrame read() const;
    /// The same, also of a dead coil or channel.
    [[nodiscard]] CouplingFrame read_any() const;

private:
    const Table& table_;
    std::array<std::size_t, kCouplings> x_;
    std::optional<std::array<std::size_t, kCouplings>> quadrature_;
    std::optional<std::array<std::size_t, kCouplings>> levels_;
    std::size_t gain_step_ = 0;  // with levels_
};

/// Throws InputError, naming the place, for couplings that are zero or have rank below three.
void check_couplings(const CouplingFrame& couplings, const TextPlace& place);

}  // namespace tricoil::host
