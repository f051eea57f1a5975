// FASTRAK session of one client: receives commands, sends records.
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>

#include "board/host/serve/fastrak/records.hpp"

namespace tricoil::host::fastrak {

/// Settings that ^K saves. All sessions of one output share them. They last until the program ends.
struct Memory {
    Settings saved;
};

class Arguments;

struct SessionLinks {
    std::function<void(std::string_view)> send;                                // sends a record; may drop it
    std::function<void(std::uint8_t sensor, const Vec3<double>&)> hemisphere;  // request to the tracker; empty: not permitted
    std::function<int()> sensors;                                              // number of tracked sensors
};

/// Commands C c P S F f U u W Y ^K ^Y act at once. O H B b G A R N x v l y have arguments and end with CR, LF or CR LF. Other
/// commands, and missing or invalid arguments, get the error record. In continuous mode each active station sends at most 120
/// records per second, the rate of a FASTRAK with one receiver; a record with a changed error letter is sent at once.
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
        Vec3<double> sent_m = Vec3<double>::Zero();          // in the last record, in the coordinate frame of the station
        UtcTime due;                                         // time of the next record in continuous mode
    };

    void byte(char c);
    bool at_once(char c);
    void run(const std::string& command);
    void restart();
    void answer_all();
    void answer(int station);
    [[nodiscard]] tracking::PoseEstimate<double> reported(int station) const;

    // One function per command.
    void output_list(const Arguments& arguments);
    void hemisphere(const Arguments& arguments);
    void boresight(const Arguments& arguments, bool on);
    void boresight_reference(const Arguments& arguments);
    void alignment(const Arguments& arguments);
    void reset_alignment(const Arguments& arguments);
    void tip(const Arguments& arguments);
    void filter(const Arguments& arguments, std::size_t which);
    void active(const Arguments& arguments);
    void synchronization(const Arguments& arguments);

    StationSettings& station(int number) { return settings_.stations[static_cast<std::size_t>(number - 1)]; }

    SessionLinks links_;
    std::shared_ptr<Memory> memory_;
    Settings settings_;
    std::array<Newest, kStations> newest_;
    std::string command_;      // incomplete command
    bool discarding_ = false;  // true for the rest of a command that is too long
    int status_station_ = 1;
};

}  // namespace tricoil::host::fastrak
