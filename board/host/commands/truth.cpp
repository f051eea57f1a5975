// tricoil truth: options of the ground truth, which is the Python package's _truth.py.
#include "board/host/commands/program.hpp"
#include "board/host/commands/reader_options.hpp"

namespace tricoil::host {
namespace {

constexpr std::array<TextOption, 8> kTruthOptions{{
    {"--imu", "Accelerations and angular rates (time_s, acc_x_m_s2 ..., gyr_x_rad_s ...); may be in POSES", kFileType},
    {"--joints", "Joint values of a robot: time_s and one column a joint, rad or m", kFileType},
    {"--chain", "Kinematic chain of --joints: URDF, or table of joint,type,a_m,alpha_rad,d_m,theta_rad,convention", kFileType},
    {"--link", "Last link of the chain, in a URDF with several", "TEXT"},
    {"--lever", "Place of the inertial sensor in the body, m; default: estimated", "X,Y,Z"},
    {"--mount", "Attitude of the inertial sensor in the body; default: estimated", "QW,QX,QY,QZ"},
    {"--out", "Path with deviations (CSV), for evaluate --dynamic and motion --reference; - is standard output", kFileType},
    {"--plot", "Picture of path and deviation", kFileType},
}};

}  // namespace

void add_truth_command(CLI::App* sub, Action& action) {
    add_files(sub, "poses", "Optical poses or positions; the first file gives frame, body and clock of the path");
    add_text_options(sub, kTruthOptions);
    add_reader_options(sub);
    sub->add_flag("--same-clock")->description("--imu: its clock is that of the poses; default: the offset is estimated");
    sub->add_flag("--json")->description("Result as JSON");
    set_examples(
        sub, {{"optical poses with gaps, bridged by an inertial sensor", "tricoil truth optics.csv --imu imu.csv --out path.csv"},
              {"a robot", "tricoil truth --joints joints.csv --chain robot.urdf --out path.csv"}});
    run_in_python(sub, action);
}

}  // namespace tricoil::host
