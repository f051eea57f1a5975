// FASTRAK session of one client: receives commands, sends records.
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>

#include "board/host/serve/fastrak/records.hpp"
#include "board/host/serve/stylus_button.hpp"

namespace tricoil::host::fastrak {

/// Settings that ^K saves. If it is shared, later sessions start with them; otherwise it belongs to one session.
struct Memory {
    Settings saved;
    bool is_shared = true;
};

class Arguments;

struct SessionLinks {
    std::function<void(std::string_view)> send;                                // sends a record; may drop it
    std::function<void(std::uint8_t sensor, const Vec3<double>&)> hemisphere;  // request to the tracker; empty: not permitted
    std::function<int()> sensors;                                              // number of tracked sensors
    std::function<void(int baud)> line_speed;  // changes the speed of a serial port; 0: as it was opened; empty: no serial port
    std::function<StylusButton::State()> button;  // of the stylus of station 1; empty: never pressed
    /// What the client has changed (of the settings only the first change of a session), or what its records cannot show; the
    /// subject is the client.
    std::function<void(std::string_view)> notice = [](std::string_view) {};
};

/// Commands C c P S F f U u D d W Y ^K ^Y ^Q ^S act at once. The others have arguments and end with CR, LF or CR LF. Unknown
/// commands, and missing or invalid arguments, get the error record. In continuous mode each active station sends at most 120
/// records per second, the rate of a FASTRAK with one receiver; a record with a changed error letter is sent at once.
/// In point mode (command e) a press of the button requests a record of each active station, and so does every third of a second
/// while it is held; in continuous mode a press interrupts or resumes the records.
class Session {
public:
    Session(SessionLinks links, std::shared_ptr<Memory> memory);

    void receive(std::span<const char> bytes);
    void take(std::span<const ServedPose> poses);
    /// Poses from before the connection: sent only on request.
    void set_newest(std::span<const ServedPose> poses);

private:
    struct Newest {
        std::optional<tracking::PoseEstimate<double>> pose;  // source frame
        std::optional<Vec3<double>> sent_m;                  // in the last record, in the coordinate frame of the station
        char letter = ' ';                                   // of the newest pose
        UtcTime due;                                         // time of the next record in continuous mode
    };

    [[nodiscard]] bool is_streaming() const { return settings_.continuous && !interrupted_ && !suspended_; }
    bool may_start(int station);
    void follow_button();
    void byte(char c);
    bool at_once(char c);
    void run(const std::string& command);
    void settings_changed(char command);
    void restart();
    void answer_all(bool only_moved = false);
    void answer(int station);
    [[nodiscard]] tracking::PoseEstimate<double> reported(int station) const;

    [[nodiscard]] bool has_moved(int station) const;
    [[nodiscard]] char letter(int station) const;
    [[nodiscard]] tracking::PoseEstimate<double> mounted(int station) const;

    // Commands that need more than the settings.
    void status();
    void hemisphere(const Arguments& arguments);
    void boresight(const Arguments& arguments, bool on);
    void active(const Arguments& arguments);
    void built_in_test(const Arguments& arguments);

    Newest& newest(int number) { return newest_[static_cast<std::size_t>(number - 1)]; }
    [[nodiscard]] const Newest& newest(int number) const { return newest_[static_cast<std::size_t>(number - 1)]; }
    [[nodiscard]] const StationSettings& station(int number) const {
        return settings_.stations[static_cast<std::size_t>(number - 1)];
    }
    StationSettings& station(int number) { return settings_.stations[static_cast<std::size_t>(number - 1)]; }

    SessionLinks links_;
    std::shared_ptr<Memory> memory_;
    Settings settings_;
    std::array<Newest, kStations> newest_;
    std::string command_;  // incomplete command
    StylusButton::State button_;
    bool is_changed_ = false;    // a setting, by the client
    bool is_roll_said_ = false;  // that a roll is undefined
    bool is_pressed_ = false;    // item 16
    HostTime next_press_{};      // earlier presses are ignored
    bool interrupted_ = false;   // by the button: no records of the continuous mode
    bool started_ = false;       // the first active station has sent a record since the stream began
    bool suspended_ = false;     // ^S: no records of the continuous mode
    bool discarding_ = false;    // true for the rest of a command that is too long
    int status_station_ = 1;
};

}  // namespace tricoil::host::fastrak
