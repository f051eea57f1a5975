#include "board/record/convert.hpp"

#include <array>

#include "board/pose_text/pose_stages.hpp"
#include "board/support/components.hpp"
#include "board/support/errors.hpp"
#include "board/support/nearest_name.hpp"
#ifdef TRICOIL_WITH_OPENIGTLINK
#include "board/pose_text/openigtlink/igtl_messages.hpp"
#endif

namespace tricoil::host {
namespace {

using Pose = tracking::PoseEstimate<double>;

std::uint64_t for_each_pose(const Recording& recording, const std::function<void(const Pose&)>& take, const ShowShare& progress) {
    RecordLines poses(recording.folder(), RecordFile::poses);
    std::uint64_t count = 0;
    for (std::string line; poses.next(line); ++count) {
        take(parse_pose(line, poses.where()));
        if (progress) {
            progress(poses.share());
        }
    }
    return count;
}

using Form = std::function<void(const Pose&)>;
using Put = std::function<void(std::string_view)>;

Form csv_form(const Put& put, const PoseStages& stages) {
    const PoseUnits& units = stages.units();
    put(pose_column_names(kPoseForm, units) + "\n");
    return [&put, units](const Pose& pose) { put(pose_line({pose}, PoseFormat::csv, kPoseForm, units)); };
}

template <bool has_matrices>
Form json_form(const Put& put, const PoseStages& stages) {
    constexpr PoseForm kForm = has_matrices ? kPoseForm | PoseForm{PoseFieldId::covariance, PoseFieldId::couplings} : kPoseForm;
    return [&put, units = stages.units()](const Pose& pose) { put(pose_line({pose}, PoseFormat::json, kForm, units)); };
}

#ifdef TRICOIL_WITH_OPENIGTLINK
/// Messages as a server would send them, stamped with the time in the recording.
std::string igtl_bytes(const Pose& pose) {
    const ServedPose served{pose, utc_time_us(to_us(pose.time))};
    return pose.valid() ? igtl_output::transform_message(served) : igtl_output::status_message(served);
}

Form igtl_form(const Put& put, const PoseStages&) {
    return [&put](const Pose& pose) { put(igtl_bytes(pose)); };
}
#else
constexpr Form (*igtl_form)(const Put&, const PoseStages&) = nullptr;
#endif

}  // namespace

const std::vector<std::string>& convert_formats() {
    static const std::vector<std::string> names{"jsonl", "csv", "full", "openigtlink"};
    return names;
}

std::uint64_t convert(const Recording& recording, const std::string& name, const OutputOptions& options,
                      const std::function<void(std::string_view)>& put, const ShowShare& progress) {
    if (name == "openigtlink") {
        require(Component::openigtlink, "--to openigtlink");
        refuse_if(options.unit != OutputOptions{}.unit, "--units: not with --to openigtlink, which defines its own units");
        refuse_if(!options.euler.empty(), "--euler: not with --to openigtlink, which has no angles");
    }
    constexpr std::array<Form (*)(const Put&, const PoseStages&), 4> kForms{json_form<false>, csv_form, json_form<true>,
                                                                            igtl_form};
    const std::size_t index = index_of_name("--to", name, convert_formats());
    Form form;
    PoseTap tap([&](const Pose& pose) { form(pose); });
    PoseStages stages(options, tap);
    form = kForms.at(index)(put, stages);
    const std::uint64_t count = for_each_pose(
        recording, [&](const Pose& pose) { stages.pose(pose); }, progress);
    stages.finish();
    return count;
}

}  // namespace tricoil::host
