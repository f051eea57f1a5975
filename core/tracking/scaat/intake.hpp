// Intake of columns: refusal of invalid columns, and grouping into measurements.
#pragma once

#include "core/tracking/column_check.hpp"
#include "core/tracking/signal_flags.hpp"
#include "core/tracking/signal_matrix_assembler.hpp"

namespace tricoil::tracking::scaat {

/// Columns with these flags contain no information on the couplings.
constexpr ColumnFlags kUnusable{ColumnFlag::no_reference, ColumnFlag::saturated, ColumnFlag::clipped,     ColumnFlag::stuck,
                                ColumnFlag::overrun,      ColumnFlag::dc_offset, ColumnFlag::gain_changed};

/// In TDM each column is a measurement. In FDM the three columns of one time are one measurement. It is complete when all three
/// have come; the columns of an incomplete frame wait until the next frame begins.
template <typename Scalar>
class Intake {
public:
    explicit Intake(const CommonParams<Scalar>& params, Microseconds max_lateness)
        : latest_(params.max_column_span),
          time_base_(max_lateness, params.lost_after),
          in_frames_(params.max_column_span.count() == 0) {}

    struct Admission {
        std::optional<Rejection> rejection;
        bool is_late = false;        // older than the newest column, but usable
        bool has_restarted = false;  // the device clock restarted
    };

    Admission admit(const Column<Scalar>& column) {
        if (const auto reason = invalid_field(column)) {
            return {reason};
        }
        using Verdict = TimeBase::Verdict;
        const Verdict verdict = time_base_.take(coil_index(column.state), column.midpoint, true);
        return {reason_of(verdict), verdict == Verdict::late, verdict == Verdict::restarted};
    }

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

    /// True if columns of all coils have come at the newest time.
    [[nodiscard]] bool frame_is_over() const {
        constexpr unsigned kAllCoils = 7;  // one bit per coil
        return time_base_.coils_at_newest() == kAllCoils;
    }

    [[nodiscard]] const SignalMatrixAssembler<Scalar>& columns() const { return latest_; }

    /// Stores the flags of the newest column of each coil.
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
    TimeBase time_base_;
    bool in_frames_;
    unsigned waiting_ = 0;  // one bit per coil
    std::array<PoseFlags, kSourceCoils> flags_{};
};

}  // namespace tricoil::tracking::scaat
