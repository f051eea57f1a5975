#include "board/pose_text/pose_csv.hpp"

#include <utility>

namespace tricoil::host {
namespace {

tracking::PoseEstimate<double> pose_of(std::uint8_t sensor, const TruePose& truth) {
    tracking::PoseEstimate<double> e;
    e.sensor = sensor;
    e.position_m = truth.position_m;
    e.q_source_sensor = truth.q_source_sensor;
    return e;
}

}  // namespace

PoseCsv::PoseCsv(const std::string& path, OutputFormat format) : file_(path), format_(std::move(format)) {
    file_.write(pose_column_names(kScoredForm, format_.units) + "\n");
}

void PoseCsv::write(const tracking::PoseEstimate<double>& estimate, const TruePose& true_pose) {
    if (format_.boresight_first && estimate.valid()) {
        tracking::boresight(format_.frame, estimate.q_source_sensor);
        format_.boresight_first = false;
    }
    const auto e = tracking::in_frame(format_.tips.at_tip(estimate), format_.frame);
    const auto truth = tracking::in_frame(format_.tips.at_tip(pose_of(estimate.sensor, true_pose)), format_.frame);
    const TruePose seen{truth.position_m, truth.q_source_sensor};  // of the tip, if there is one, as the reported point
    file_.write(pose_line({e, &seen}, PoseFormat::csv, kScoredForm, format_.units));
}

}  // namespace tricoil::host
