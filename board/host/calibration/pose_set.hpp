// Couplings at known stage poses, for calibration and evaluation.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "board/support/coupling_text.hpp"
#include "core/linear/matrix.hpp"

namespace tricoil::host {

/// One line of a file. The sensor's mount is on the stage: v_stage = stage_position_m + stage_rotation v_mount.
struct MeasuredPose : CouplingFrame {
    Vec3<double> stage_position_m;
    Mat3<double> stage_rotation;
    std::size_t line = 0;  // in the file, from 1
};

/// One file, recorded with fixed fixtures; only the stage moves.
struct PoseFile {
    std::string path;
    std::string source_fixture;  // from the file name, "YoutZup" for soYoutZup_...; empty if not given
    std::string sensor_fixture;
    std::vector<MeasuredPose> poses;
};

/// Differences of a file's wiring from that of the set.
struct FileWiring {
    bool transposed = false;  // the file has the couplings in the order of the sensor coils, CSV: of the source coils
    Vec3<double> source = Vec3<double>::Ones();  // -1 for each reversed coil
    Vec3<double> sensor = Vec3<double>::Ones();

    [[nodiscard]] bool differs() const { return transposed || source.minCoeff() < 0 || sensor.minCoeff() < 0; }
    /// Corrects all couplings of the file.
    void correct(PoseFile& file) const;
    /// The same signs of all couplings, with the smaller number of reversed coils.
    void count_fewest();
    /// "coils 1, 2 of the source reversed".
    [[nodiscard]] std::string text() const;
};

/// Name of a file's fixture: as stated by the file, otherwise "source" or the file name.
std::string sensor_fixture_name(const PoseFile& file);
std::string source_fixture_name(const PoseFile& file);

/// Orientation from a fixture name: "ZinXdown" has z pointing in and x pointing down. Directions in the stage frame: right +x,
/// left -x, out +y, in -y, up +z, down -z. The name gives two axes; the third follows. Returns the rotation from the mounted
/// frame to the stage frame (v_stage = R v_mounted); empty if the name does not give two different axes in orthogonal directions.
std::optional<Mat3<double>> rotation_of_fixture(const std::string& name);

/// Reads either format. Lines whose couplings are all zero (sensor not connected) are skipped, with a notice. Throws InputError,
/// naming file and line.
/// - ILEMT text: x y z (mm) and Euler angles Rx Ry Rz (deg; rotation Rz Ry Rx) of the stage, then nine complex couplings as
/// +0.1-0.2i, (source 1, sensor 1), (source 2, sensor 1), ..., and optionally nine more of a second carrier, which are checked
/// but not used.
/// - PoseTable with CouplingColumns.
PoseFile read_pose_file(const std::string& path, const ChannelWiring& wiring = {});
PoseFile read_pose_file(Table& table, const ChannelWiring& wiring = {});

/// All files; throws InputError also if one is named twice. fixtures: FILE=NAME, with NAME soSOURCE_seSENSOR or only the
/// source's, instead of those in the file names.
std::vector<PoseFile> read_pose_files(const std::vector<std::string>& paths, const std::vector<std::string>& fixtures = {},
                                      const ChannelWiring& wiring = {});

std::size_t count_poses(const std::vector<PoseFile>& files);

}  // namespace tricoil::host
