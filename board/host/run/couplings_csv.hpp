// CSV file with true poses and couplings of a simulated run, as tricoil calibrate and evaluate read them.
#pragma once

#include <cstddef>
#include <optional>
#include <string>

#include "board/support/output_file.hpp"
#include "core/tracking/tracker_tap.hpp"

namespace tricoil::host {

/// One line per pose: kPoseCsvHeader and kQuadratureColumns. As a tap it takes the quadratures. The signal matrices of a resting
/// sensor are averaged, without the first three and the last of a rest: their windows and columns may be older or later than the
/// rest.
class CouplingsCsv final : public tracking::TrackerTap<double> {
public:
    /// Opens the file and writes the header. Throws like OutputFile.
    explicit CouplingsCsv(const std::string& path);

    /// x: of the columns that the tap took last.
    void add(const Mat3<double>& x, const solver::RigidPose<double>& truth);

    /// Writes the last pose and moves the file into place; without a pose no file remains. Returns the number of poses. Throws
    /// like OutputFile::commit().
    std::size_t commit();

private:
    struct Couplings {
        Mat3<double> in_phase = Mat3<double>::Zero();
        Mat3<double> quadrature = Mat3<double>::Zero();
    };

    void do_column(const MeasuredColumn<double>& column) override;
    void end_pose();

    OutputFile file_;
    std::optional<solver::RigidPose<double>> pose_;
    std::size_t poses_ = 0;  // written
    int matrices_ = 0;       // of this pose
    Couplings last_;
    Couplings sum_;                                   // of all but the first three and the last
    Mat3<double> quadrature_ = Mat3<double>::Zero();  // of the last columns
};

}  // namespace tricoil::host
