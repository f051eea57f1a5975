#include "board/host/serve/fastrak/session.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>

#include "board/host/serve/fastrak/arguments.hpp"
#include "core/base/angle_units.hpp"

namespace tricoil::host::fastrak {
namespace {

constexpr std::size_t kLongestCommand = 256;
constexpr Microseconds kPeriod{1'000'000 / 120};
constexpr Microseconds kJitter{1000};
constexpr double kLongest = 1000;  // limit of coordinates, inches or centimetres

constexpr std::size_t kPositionFilter = 0;
constexpr std::size_t kAttitudeFilter = 1;

constexpr char kControlK = 11;
constexpr char kControlY = 25;

Vec3<double> nothing() { return Vec3<double>::Zero(); }

}  // namespace

Session::Session(SessionLinks links, std::shared_ptr<Memory> memory)
    : links_(std::move(links)), memory_(std::move(memory)), settings_(memory_->saved) {}

void Session::receive(std::span<const char> bytes) {
    for (const char c : bytes) {
        byte(c);
    }
}

void Session::byte(char c) {
    const bool ends = c == '\r' || c == '\n';
    if (discarding_) {
        discarding_ = !ends;
        return;
    }
    if (command_.empty() && (ends || c == ' ' || at_once(c))) {
        return;
    }
    if (!ends) {
        command_ += c;
        constexpr std::string_view kWithArguments = "OHBbGARNxvly";
        if (kWithArguments.find(command_.front()) == std::string_view::npos) {
            links_.send(error_record(command_, CommandError::undefined, 0, 0, 1));
            command_.clear();
        } else if (command_.size() > kLongestCommand) {
            links_.send(error_record(command_.substr(0, 16), CommandError::too_long, kLongestCommand, 0, 1));
            command_.clear();
            discarding_ = true;
        }
        return;
    }
    const std::string command = std::exchange(command_, {});
    try {
        run(command);
    } catch (const Refusal& refusal) {
        links_.send(error_record(command, refusal.error, refusal.position, refusal.field, refusal.station));
    }
}

bool Session::at_once(char c) {
    switch (c) {
        case 'C':
        case 'c':
            settings_.continuous = c == 'C';
            return true;
        case 'F':
        case 'f':
            settings_.binary = c == 'f';
            return true;
        case 'U':
        case 'u':
            settings_.centimetres = c == 'u';
            return true;
        case 'P':
            answer_all();
            return true;
        case 'S': {
            const auto& pose = newest_[static_cast<std::size_t>(status_station_ - 1)].pose;
            links_.send(status_record(settings_, status_station_, links_.sensors(), pose ? error_letter(*pose) : ' '));
            // Each request reports the next station (manual).
            status_station_ = status_station_ % std::max(links_.sensors(), 1) + 1;
            return true;
        }
        case 'W':
            settings_ = Settings{};
            return true;
        case 'Y':  // ends the point mode, which this emulation does not have
            return true;
        case kControlK:
            memory_->saved = settings_;
            return true;
        case kControlY:
            restart();
            return true;
        default:
            return false;
    }
}

void Session::restart() {
    settings_ = memory_->saved;
    newest_ = {};
    status_station_ = 1;
}

void Session::run(const std::string& command) {
    const Arguments arguments(command);
    switch (command.front()) {
        case 'O':
            return output_list(arguments);
        case 'H':
            return hemisphere(arguments);
        case 'B':
        case 'b':
            return boresight(arguments, command.front() == 'B');
        case 'G':
            return boresight_reference(arguments);
        case 'A':
            return alignment(arguments);
        case 'R':
            return reset_alignment(arguments);
        case 'N':
            return tip(arguments);
        case 'x':
            return filter(arguments, kPositionFilter);
        case 'v':
            return filter(arguments, kAttitudeFilter);
        case 'l':
            return active(arguments);
        default:
            return synchronization(arguments);
    }
}

void Session::take(std::span<const ServedPose> poses) {
    for (const ServedPose& served : poses) {
        const auto& pose = served.pose;
        if (pose.sensor >= kStations) {
            continue;
        }
        Newest& newest = newest_[pose.sensor];
        const bool letter_changes = newest.pose && error_letter(*newest.pose) != error_letter(pose);
        newest.pose = pose;
        const int number = pose.sensor + 1;
        if (!settings_.continuous || !station(number).active) {
            continue;
        }
        const bool began_anew = served.utc < newest.due - 2 * kPeriod;
        if (served.utc >= newest.due - kJitter || began_anew) {
            const bool fell_behind = served.utc > newest.due + kPeriod || began_anew;
            newest.due = (fell_behind ? served.utc : newest.due) + kPeriod;
            answer(number);
        } else if (letter_changes) {
            answer(number);
        }
    }
}

void Session::set_newest(std::span<const ServedPose> poses) {
    for (const ServedPose& served : poses) {
        if (served.pose.sensor < kStations) {
            newest_[served.pose.sensor].pose = served.pose;
        }
    }
}

void Session::answer_all() {
    for (int number = 1; number <= std::clamp(links_.sensors(), 1, kStations); ++number) {
        if (station(number).active) {
            answer(number);
        }
    }
}

tracking::PoseEstimate<double> Session::reported(int number) const {
    const auto& newest = newest_[static_cast<std::size_t>(number - 1)];
    return tracking::in_frame(*newest.pose, settings_.stations[static_cast<std::size_t>(number - 1)].frame);
}

void Session::answer(int number) {
    Newest& newest = newest_[static_cast<std::size_t>(number - 1)];
    if (!newest.pose) {  // no pose yet: no signal
        links_.send(data_record(settings_, number, {}, 'l', nothing()));
        return;
    }
    const auto pose = reported(number);
    links_.send(data_record(settings_, number, pose, error_letter(*newest.pose), newest.sent_m));
    newest.sent_m = pose.position_m;
}

void Session::output_list(const Arguments& arguments) {
    const int number = arguments.station();
    const std::size_t count = arguments.count_from(1);
    StationSettings& s = station(number);
    if (count == 0) {
        std::string items;
        for (const int item : s.output_list) {
            items += fmt::format("{:2d}", item);
        }
        links_.send(text_record(std::to_string(number), 'O', items));
        return;
    }
    std::vector<int> list;
    for (std::size_t n = 1; n <= count; ++n) {
        const std::optional<double> item = arguments.number(n);
        if (!item) {
            arguments.refuse(n, CommandError::field_missing);
        }
        if (*item != std::floor(*item) || std::abs(*item) > 100 || !is_item(static_cast<int>(*item)) || n > kLongestList) {
            arguments.refuse(n, CommandError::out_of_range);
        }
        list.push_back(static_cast<int>(*item));
    }
    if (record_size(list, false) > kLongestRecord) {
        arguments.refuse(count, CommandError::too_long);
    }
    s.output_list = list;
}

void Session::hemisphere(const Arguments& arguments) {
    const int number = arguments.station();
    StationSettings& s = station(number);
    if (arguments.count_from(1) == 0) {
        links_.send(values_record(number, 'H', {s.hemisphere.data(), 3}));
        return;
    }
    if (!links_.hemisphere) {
        arguments.refuse(0, CommandError::not_configured);
    }
    s.hemisphere = arguments.vector(1, s.hemisphere, kLongest);
    if (!s.hemisphere.isZero()) {  // zero selects hemisphere tracking (manual), the default of this tracker
        links_.hemisphere(static_cast<std::uint8_t>(number - 1), s.hemisphere);
    }
}

void Session::boresight(const Arguments& arguments, bool on) {
    const int number = arguments.station();
    StationSettings& s = station(number);
    const auto& pose = newest_[static_cast<std::size_t>(number - 1)].pose;
    if (!on) {
        s.frame.q_sensor_boresight = Quat<double>::Identity();
    } else if (pose && pose->valid()) {
        const Vec3<double> reference = kRadians * s.boresight_reference_deg;
        tracking::boresight(s.frame, pose->q_source_sensor,
                            geometry::attitude_quaternion<double>(geometry::attitude_matrix<double>(
                                geometry::Euler<double>{reference.x(), reference.y(), reference.z()})));
    }
}

void Session::boresight_reference(const Arguments& arguments) {
    const int number = arguments.station();
    StationSettings& s = station(number);
    if (arguments.count_from(1) == 0) {
        links_.send(values_record(number, 'G', {s.boresight_reference_deg.data(), 3}));
        return;
    }
    s.boresight_reference_deg = arguments.vector(1, s.boresight_reference_deg, 180);
}

void Session::alignment(const Arguments& arguments) {
    const int number = arguments.station();
    StationSettings& s = station(number);
    const double scale = settings_.units_per_m();
    if (arguments.count_from(1) == 0) {
        std::array<double, 9> values{};
        for (std::size_t n = 0; n < values.size(); ++n) {
            values[n] = scale * s.alignment_m[n / 3][static_cast<Eigen::Index>(n % 3)];
        }
        links_.send(values_record(number, 'A', values));
        return;
    }
    std::array<Vec3<double>, 3> seen;    // in the present alignment frame, like the poses that the user reads
    std::array<Vec3<double>, 3> source;  // in the source frame
    for (std::size_t n = 0; n < seen.size(); ++n) {
        seen[n] = arguments.vector(1 + 3 * n, scale * s.alignment_m[n], kLongest) / scale;
        source[n] = s.frame.origin_m + s.frame.q_source_alignment * seen[n];
    }
    if (!tracking::align(s.frame, source[0], source[1], source[2]).ok()) {
        arguments.refuse(1, CommandError::out_of_range);
    }
    s.alignment_m = seen;
}

void Session::reset_alignment(const Arguments& arguments) {
    StationSettings& s = station(arguments.station());
    s.frame.origin_m.setZero();
    s.frame.q_source_alignment.setIdentity();
    s.alignment_m = kAlignment_m;
}

void Session::tip(const Arguments& arguments) {
    const int number = arguments.station();
    StationSettings& s = station(number);
    const double scale = settings_.units_per_m();
    if (arguments.count_from(1) == 0) {
        const Vec3<double> tip = scale * s.frame.tip_m;
        links_.send(values_record(number, 'N', {tip.data(), 3}));
        return;
    }
    s.frame.tip_m = arguments.vector(1, scale * s.frame.tip_m, kLongest) / scale;
}

void Session::filter(const Arguments& arguments, std::size_t which) {
    auto& values = settings_.filters[which];
    const std::size_t count = arguments.count_from(0);
    if (count == 0) {
        std::string text;
        for (const double value : values) {
            text += fmt::format("{:7.3f}", value);
        }
        links_.send(text_record(" ", which == kPositionFilter ? 'x' : 'v', text));
        return;
    }
    const std::optional<double> first = arguments.number(0);
    if (count == 1 && first && *first >= 1) {  // predefined setting, 1 to 5; 1 and 2: no filter
        if (*first > 5 || *first != std::floor(*first)) {
            arguments.refuse(0, CommandError::out_of_range);
        }
        constexpr std::array kReadyMade{kNoFilter, kNoFilter, kWeakFilter, kMediumFilter, kStrongFilter};
        values = kReadyMade[static_cast<std::size_t>(*first) - 1];
        if (which == kAttitudeFilter) {  // the attitude filter also sets the position filter
            settings_.filters[kPositionFilter] = values;
        }
        return;
    }
    auto wanted = values;
    for (std::size_t n = 0; n < wanted.size(); ++n) {
        wanted[n] = arguments.number(n, values[n], 1);
        if (wanted[n] < 0) {
            arguments.refuse(n, CommandError::out_of_range);
        }
    }
    values = wanted;
}

void Session::active(const Arguments& arguments) {
    const int number = arguments.station();
    const int sensors = links_.sensors();
    const std::optional<double> wanted = arguments.number(1);
    if (!wanted) {
        std::string states;
        for (int n = 1; n <= kStations; ++n) {
            states += n <= sensors && station(n).active ? '1' : '0';
        }
        links_.send(text_record(std::to_string(number), 'l', states));
        return;
    }
    if (*wanted != 0 && *wanted != 1) {
        arguments.refuse(1, CommandError::out_of_range);
    }
    station(number).active = *wanted == 1;
}

void Session::synchronization(const Arguments& arguments) {
    const std::optional<double> mode = arguments.number(0);
    if (!mode) {
        links_.send(text_record(" ", 'y', "0"));
    } else if (*mode != 0) {
        arguments.refuse(0, *mode == 1 || *mode == 2 ? CommandError::not_configured : CommandError::out_of_range);
    }
}

}  // namespace tricoil::host::fastrak
