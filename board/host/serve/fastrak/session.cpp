#include "board/host/serve/fastrak/session.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "board/host/serve/fastrak/setting_commands.hpp"
#include "core/base/angle_units.hpp"
#include "core/tracking/hemisphere.hpp"

namespace tricoil::host::fastrak {
namespace {

constexpr std::size_t kLongestCommand = 256;
constexpr Microseconds kPeriod{1'000'000 / 120};
constexpr Microseconds kJitter{1000};
constexpr Microseconds kSwitchCycle{333'333};  // 40 cycles of 1/120 s (manual, section 11)

constexpr char kControlK = 11;
constexpr char kControlQ = 17;
constexpr char kControlS = 19;
constexpr char kControlY = 25;

Vec3<double> nothing() { return Vec3<double>::Zero(); }

bool has_arguments(char letter) {
    constexpr std::string_view kOthers = "HBblT";  // executed by the session
    return std::string_view(kSettingCommands).find(letter) != std::string_view::npos ||
           kOthers.find(letter) != std::string_view::npos;
}

/// Attitude with this azimuth, elevation and roll.
Quat<double> attitude_of(const Vec3<double>& angles_deg) {
    const Vec3<double> a = kRadians * angles_deg;
    return geometry::attitude_quaternion<double>(geometry::attitude_matrix<double>(geometry::Euler<double>{a.x(), a.y(), a.z()}));
}

}  // namespace

Session::Session(SessionLinks links, std::shared_ptr<Memory> memory)
    : links_(std::move(links)), memory_(std::move(memory)), settings_(memory_->saved) {
    if (links_.button) {
        button_ = links_.button();
    }
}

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
        if (!has_arguments(command_.front())) {
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
            started_ = false;
            interrupted_ = false;
            suspended_ = false;  // there are clients that send ^S, but never ^Q
            return true;
        case 'F':
        case 'f':
            settings_.binary = c == 'f';
            settings_changed(c);
            return true;
        case 'U':
        case 'u':
            settings_.centimetres = c == 'u';
            settings_changed(c);
            return true;
        case 'P':
            answer_all();
            return true;
        case 'S':
            status();
            return true;
        case 'D':
        case 'd':
            settings_.metal_compensation = c == 'D';
            settings_changed(c);
            return true;
        case 'W':
            settings_ = Settings{};
            settings_changed(c);
            return true;
        case 'Y':  // not in the manual; VRPN sends it to end the point mode of other devices
            return true;
        case kControlK:
            memory_->saved = settings_;
            links_.notice(memory_->is_shared ? "changed saved settings (^K) for later clients"
                                             : "changed saved settings (^K) of its session");
            return true;
        case kControlY:
            restart();
            return true;
        case kControlQ:
        case kControlS:
            suspended_ = c == kControlS;
            return true;
        default:
            return false;
    }
}

void Session::restart() {
    settings_ = memory_->saved;
    newest_ = {};
    interrupted_ = false;
    suspended_ = false;
    status_station_ = 1;
    if (links_.line_speed) {
        links_.line_speed(settings_.baud);
    }
}

void Session::settings_changed(char command) {
    if (!std::exchange(is_changed_, true)) {
        links_.notice(fmt::format("changed settings ({}) of its session", command));
    }
}

void Session::run(const std::string& command) {
    const Arguments arguments(command);
    const char letter = command.front();
    switch (letter) {
        case 'H':
            return hemisphere(arguments);
        case 'B':
        case 'b':
            return boresight(arguments, letter == 'B');
        case 'l':
            return active(arguments);
        case 'T':
            return built_in_test(arguments);
        default:
            break;
    }
    const std::string record = execute_setting(settings_, letter, arguments);
    if (record.empty()) {
        settings_changed(letter);
    } else {
        links_.send(record);
    }
    if (letter == 'o' && links_.line_speed) {
        links_.line_speed(settings_.baud);
    }
}

void Session::take(std::span<const ServedPose> poses) {
    for (const ServedPose& served : poses) {
        const auto& pose = served.pose;
        if (pose.sensor >= kStations) {
            continue;
        }
        const int number = pose.sensor + 1;
        Newest& newest = this->newest(number);
        const bool is_first = !newest.pose;
        newest.pose = pose;
        const bool letter_changes = newest.letter != letter(number) && !is_first;
        newest.letter = letter(number);
        if (pose.flags.has(tracking::PoseFlag::roll_undefined) && !std::exchange(is_roll_said_, true)) {
            links_.notice(fmt::format("reads poses of station {}, whose roll is undefined; a record cannot show this", number));
        }
        if (!is_streaming() || !station(number).active || !may_start(number)) {
            continue;
        }
        const bool began_anew = served.utc < newest.due - 2 * kPeriod;
        if (served.utc >= newest.due - kJitter || began_anew) {
            const bool fell_behind = served.utc > newest.due + kPeriod || began_anew;
            newest.due = (fell_behind ? served.utc : newest.due) + kPeriod;
            if (has_moved(number) || letter_changes) {
                answer(number);
            }
        } else if (letter_changes) {
            answer(number);
        }
    }
    follow_button();
    started_ = started_ && is_streaming();
}

/// The stream begins with the first active station, unless that station is silent (manual, section 11).
bool Session::may_start(int number) {
    int first = 1;
    while (!station(first).active) {
        ++first;
    }
    const auto& pose = newest(first).pose;
    started_ = started_ || number == first || !pose || pose->flags.has(tracking::PoseFlag::stale);
    return started_;
}

void Session::follow_button() {
    if (!links_.button) {
        return;
    }
    const std::uint32_t presses = button_.presses;
    button_ = links_.button();
    const bool is_new = button_.presses != presses;
    is_pressed_ = button_.down || is_new;
    const bool repeats = button_.down && !settings_.continuous;
    if (!station(kStylusStation).point_mode || !(is_new || repeats) || button_.time < next_press_) {
        return;
    }
    next_press_ = button_.time + kSwitchCycle;
    if (settings_.continuous) {
        interrupted_ = !interrupted_;
    } else {
        answer_all(true);
    }
}

void Session::set_newest(std::span<const ServedPose> poses) {
    for (const ServedPose& served : poses) {
        if (served.pose.sensor < kStations) {
            const int number = served.pose.sensor + 1;
            newest(number).pose = served.pose;
            newest(number).letter = letter(number);
        }
    }
}

void Session::answer_all(bool only_moved) {
    for (int number = 1; number <= std::clamp(links_.sensors(), 1, kStations); ++number) {
        if (station(number).active && (!only_moved || !newest(number).pose || has_moved(number))) {
            answer(number);
        }
    }
}

tracking::PoseEstimate<double> Session::mounted(int number) const {
    tracking::OutputFrame<double> mounting;
    mounting.q_source_alignment = attitude_of(station(number).mounting_deg);
    return tracking::in_frame(*newest(number).pose, mounting);
}

tracking::PoseEstimate<double> Session::reported(int number) const {
    return tracking::in_frame(mounted(number), station(number).frame);
}

char Session::letter(int number) const { return error_letter(reported(number), station(number)); }

/// True if the station has moved by its increment in any axis since its last record.
bool Session::has_moved(int number) const {
    constexpr double kRounding_m = 1e-9;
    const std::optional<Vec3<double>>& sent_m = newest(number).sent_m;
    const double needed_m = station(number).increment_m - kRounding_m;
    return !sent_m || needed_m <= 0 || (reported(number).position_m - *sent_m).cwiseAbs().maxCoeff() >= needed_m;
}

void Session::answer(int number) {
    Newest& newest = this->newest(number);
    const bool is_pressed = number == kStylusStation && is_pressed_;
    if (!newest.pose || !newest.pose->position_m.allFinite()) {  // no signal
        const char why = newest.pose ? letter(number) : 'l';
        links_.send(data_record(settings_, number, {}, why, nothing(), is_pressed));
        return;
    }
    const auto pose = reported(number);
    links_.send(data_record(settings_, number, pose, letter(number), newest.sent_m.value_or(nothing()), is_pressed));
    newest.sent_m = pose.position_m;
}

void Session::status() {
    const bool has_pose = newest(status_station_).pose.has_value();
    links_.send(status_record(settings_, status_station_, links_.sensors(), has_pose ? letter(status_station_) : ' '));
    // Each request reports the next station (manual).
    status_station_ = status_station_ % std::max(links_.sensors(), 1) + 1;
}

void Session::hemisphere(const Arguments& arguments) {
    const int number = arguments.station();
    StationSettings& s = station(number);
    if (arguments.count_from(1) == 0) {
        links_.send(values_record(number, 'H', {s.hemisphere.data(), 3}, kThousandths));
        return;
    }
    if (!links_.hemisphere) {
        arguments.refuse(0, CommandError::not_configured);
    }
    const Vec3<double> towards = arguments.vector(1, s.hemisphere, kLongest);
    if (!tracking::is_hemisphere(towards)) {
        arguments.refuse(1, CommandError::out_of_range);
    }
    s.hemisphere = towards;
    if (!towards.isZero(0)) {  // zero selects hemisphere tracking (manual), the default of this tracker
        links_.hemisphere(static_cast<std::uint8_t>(number - 1), s.hemisphere);
        links_.notice(fmt::format("changed the hemisphere of station {} for all clients", number));
    }
}

void Session::boresight(const Arguments& arguments, bool on) {
    const int number = arguments.station();
    StationSettings& s = station(number);
    const auto& pose = newest(number).pose;
    if (!on) {
        s.frame.q_sensor_boresight = Quat<double>::Identity();
    } else if (pose && pose->valid()) {
        tracking::boresight(s.frame, mounted(number).q_source_sensor, attitude_of(s.boresight_reference_deg));
    } else {
        return;
    }
    settings_changed(on ? 'B' : 'b');
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
    settings_changed('l');
}

/// Information: one digit per station, 1 if the error is present. Errors disappear with their cause, so none is cleared.
void Session::built_in_test(const Arguments& arguments) {
    constexpr int kFirst = 'A';
    constexpr int kLast = 'z';
    const double error = arguments.needed_number(0);
    if (error != std::floor(error) || error < kFirst || error > kLast) {
        arguments.refuse(0, CommandError::out_of_range);
    }
    if (arguments.number(1).value_or(0) != 0) {
        arguments.refuse(1, CommandError::out_of_range);
    }
    std::string present;
    for (const Newest& newest : newest_) {
        present += newest.pose && newest.letter == static_cast<char>(error) ? '1' : '0';
    }
    links_.send(text_record(" ", 'T', fmt::format("{:3.0f} {}", error, present)));
}

}  // namespace tricoil::host::fastrak
