#include "board/record/convert.hpp"

#include <fmt/format.h>

#include <array>
#include <memory>

#include "board/pose_text/pose_stages.hpp"
#include "board/record/rest_couplings.hpp"
#include "board/support/components.hpp"
#include "board/support/errors.hpp"
#include "board/support/nearest_name.hpp"
#include "board/support/table.hpp"
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

/// One form: a function for each pose. finish: the end of records that are not one a pose, and their number; may be empty.
struct Form {
    std::function<void(const Pose&)> take = {};
    std::function<int()> finish = {};
};

using Put = std::function<void(std::string_view)>;

Form csv_form(const Put& put, const PoseStages& stages) {
    const PoseUnits& units = stages.units();
    put(pose_column_names(kPoseForm, units) + "\n");
    return {[&put, units](const Pose& pose) { put(pose_line({pose}, PoseFormat::csv, kPoseForm, units)); }};
}

template <bool has_matrices>
Form json_form(const Put& put, const PoseStages& stages) {
    constexpr PoseForm kForm = has_matrices ? kPoseForm | PoseForm{PoseFieldId::covariance, PoseFieldId::couplings} : kPoseForm;
    return {[&put, units = stages.units()](const Pose& pose) { put(pose_line({pose}, PoseFormat::json, kForm, units)); }};
}

#ifdef TRICOIL_WITH_OPENIGTLINK
/// Messages as a server would send them, stamped with the time in the recording.
std::string igtl_bytes(const Pose& pose) {
    const ServedPose served{pose, utc_time_us(to_us(pose.time))};
    return pose.valid() ? igtl_output::transform_message(served) : igtl_output::status_message(served);
}

Form igtl_form(const Put& put, const PoseStages&) {
    return {[&put](const Pose& pose) { put(igtl_bytes(pose)); }};
}
#else
constexpr Form (*igtl_form)(const Put&, const PoseStages&) = nullptr;
#endif

/// Throws InputError if the recording has no measured signal matrices: poses of a device, or a calibration was used.
Form rests_form(const Put& put, const Recording& recording) {
    const auto& settings = recording.settings();
    if (!settings || settings->calibration) {
        throw InputError(recording.folder() + (settings
                                                   ? ": recorded with a calibration; --to rests needs a recording without one"
                                                   : ": has no couplings, because the device computed the poses"));
    }
    const nlohmann::json::json_pointer wiring("/source/wiring_file");
    if (const auto& known = recording.description(); known.contains(wiring) && known.at(wiring) != "") {
        put(std::string(kOfCoilsComment) + "\n");
    }
    const auto rests = std::make_shared<RestFinder>(put, recording.folder());
    return {[rests, last = DeviceTime{}](const Pose& pose) mutable {
                if (pose.sensor != 0) {
                    return;
                }
                if (pose.time < last) {  // the device started again
                    rests->restart();
                }
                last = pose.time;
                if (!pose.flags.has_any(tracking::kFaultFlags)) {
                    rests->add(pose.time, pose.signal_matrix);
                }
            },
            [rests] { return rests->finish(); }};
}

/// Stages and units that the form cannot have.
void refuse_stages(const std::string& name, const OutputOptions& options) {
    const auto refuse = [&](bool is_given, const char* option, const char* fact) {
        refuse_if(is_given, "{}: not with --to {}, {}", option, name, fact);
    };
    const bool has_own_units = name == "openigtlink" || name == "rests";
    refuse(has_own_units && options.unit != OutputOptions{}.unit, "--units", "which defines its own units");
    refuse(has_own_units && !options.euler.empty(), "--euler", "which has no angles");
    const bool has_stages =
        !options.tips.empty() || options.relative_to != 0 || !options.align_points.empty() || options.boresight;
    refuse(name == "rests" && has_stages, "--tip, --relative-to, --align and --boresight", "which has couplings, not poses");
}

}  // namespace

const std::vector<std::string>& convert_formats() {
    static const std::vector<std::string> names{"jsonl", "csv", "full", "openigtlink", "rests"};
    return names;
}

std::uint64_t convert(const Recording& recording, const std::string& name, const OutputOptions& options,
                      const std::function<void(std::string_view)>& put, const ShowShare& progress) {
    if (name == "openigtlink") {
        require(Component::openigtlink, "--to openigtlink");
    }
    constexpr std::array<Form (*)(const Put&, const PoseStages&), 4> kForms{json_form<false>, csv_form, json_form<true>,
                                                                            igtl_form};  // of poses alone
    const std::size_t index = index_of_name("--to", name, convert_formats());
    refuse_stages(name, options);
    Form form;
    PoseTap tap([&](const Pose& pose) { form.take(pose); });
    PoseStages stages(options, tap);
    form = index < kForms.size() ? kForms.at(index)(put, stages) : rests_form(put, recording);
    const std::uint64_t count = for_each_pose(
        recording, [&](const Pose& pose) { stages.pose(pose); }, progress);
    stages.finish();
    return form.finish ? static_cast<std::uint64_t>(form.finish()) : count;
}

}  // namespace tricoil::host
