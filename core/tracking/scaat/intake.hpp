// Intake of columns: grouping into measurements.
#pragma once

#include "core/tracking/front/column_check.hpp"
#include "core/tracking/front/signal_matrix_assembler.hpp"
#include "core/tracking/judge/signal_flags.hpp"

namespace tricoil::tracking::scaat {

/// In TDM each column is a measurement. In FDM the three columns of one time are one measurement. It is complete when all three
/// have come; the columns of an incomplete frame wait until the next frame begins.
template <typename Scalar>
class Intake {
public:
    explicit Intake(Microseconds max_column_span) : latest_(max_column_span), in_frames_(max_column_span.count() == 0) {}

    /// Signal matrix of the latest columns if this column completes it, for a start and for the linearisation of a frame.
    std::optional<SignalMatrix<Scalar>> add(const Column<Scalar>& column) { return latest_.add(column); }
    /// add() without the matrix: true if columns().matrix() is complete.
    bool note(const Column<Scalar>& column) { return latest_.note(column); }

    /// Adds a column to the frame at the present time; false if it is unusable.
    bool wait_for_frame(const Column<Scalar>& column) {
        if (column.flags.has_any(kUnusable)) {
            return false;
        }
        waiting_ |= 1U << static_cast<unsigned>(coil_index(column.state));
        return true;
    }

    [[nodiscard]] bool in_frames() const { return in_frames_; }
    [[nodiscard]] bool has_waiting() const { return waiting_ != 0U; }
    [[nodiscard]] bool is_waiting(int coil) const { return (waiting_ >> static_cast<unsigned>(coil) & 1U) != 0U; }
    void clear_waiting() { waiting_ = 0; }

    [[nodiscard]] const SignalMatrixAssembler<Scalar>& columns() const { return latest_; }

    void note_flags(const Column<Scalar>& column) {
        flags_[static_cast<std::size_t>(coil_index(column.state))] = signal_flags(column.flags);
    }
    [[nodiscard]] PoseFlags flags() const { return flags_[0] | flags_[1] | flags_[2]; }

    /// Start of the filter; the columns stay.
    void start() {
        flags_.fill({});
        waiting_ = 0;
    }

    /// The device clock restarted: stored columns are invalid.
    void forget() {
        latest_.clear();
        waiting_ = 0;
    }

private:
    SignalMatrixAssembler<Scalar> latest_;  // all columns while searching, only usable ones while tracking
    bool in_frames_;
    unsigned waiting_ = 0;  // one bit per coil
    std::array<PoseFlags, kSourceCoils> flags_{};
};

}  // namespace tricoil::tracking::scaat
