#include "board/host/commands/stage_options.hpp"

#include <fmt/format.h>

#include "board/command_line/option_words.hpp"
#include "board/host/commands/commands.hpp"
#include "board/support/errors.hpp"

namespace tricoil::host {

std::vector<const CLI::Option*> add_stage_options(CLI::App* sub, OutputOptions& o) {
    sub->option_defaults()->group("Poses");
    return {
        file_name(
            sub->add_option("--tip", o.tips,
                            "Poses of a tool's tip: a file of calibrate pivot, or [SENSOR:]X,Y,Z (m, sensor frame); repeatable. "
                            "Recordings keep the poses of the sensor")),
        sub->add_option(
               "--relative-to", o.relative_to,
               "Output all poses relative to this sensor (1 is the first), with their covariance; recordings stay in the "
               "source frame")
            ->type_name("SENSOR"),
        numbers(sub->add_option(
                    "--align", o.align_points,
                    "Alignment frame from three points (nine numbers, m): origin, point on the x axis, point towards the y axis"),
                "POINTS", 9),
        sub->add_flag("--boresight", o.boresight, "The attitude of the first valid pose of each sensor becomes zero"),
        one_of(sub->add_option("--units", o.unit, "Unit of positions in CSV and JSON"), kLengthUnits)->capture_default_str(),
        sub->add_option("--euler", o.euler, "CSV and JSON: add Euler angles (intrinsic) in this order of axes, for example zyx")
            ->check(refuse_empty)
            ->type_name("AXES"),
    };
}

void refuse_without_output(const std::vector<const CLI::Option*>& stages, bool has_output, const std::string& mend,
                           bool tip_is_published) {
    for (const CLI::Option* option : stages) {
        refuse_if(option->count() > 0 && !has_output && !(tip_is_published && option->get_name() == "--tip"),
                  "{}: no output for its poses; {}", option->get_name(), mend);
    }
}

void check_reference(const OutputOptions& options, int sensors, const std::string& more) {
    refuse_if(options.relative_to < 0 || options.relative_to > sensors,
              "--relative-to {}: must be the number of a sensor, 1 to {}{}", options.relative_to, sensors, more);
}

}  // namespace tricoil::host
