// Damaged recordings, other versions, and folders that are not recordings: one line that names file and place, exit code 2. Exit
// code 1 if only the poses of a replay differ.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <sstream>

#include "board/support/text_table.hpp"
#include "tests/cli/cli_runner.hpp"

namespace tricoil::test {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;

class Damage : public ::testing::Test {
protected:
    void SetUp() override {  // not SetUpTestSuite: after a failure there, ctest counts the tests as skipped
        whole_ = path_in_temp("whole");
        fs::remove_all(whole_);
        ASSERT_EQ(tricoil("run --json --duration 0.5 --record " + whole_).exit_code, 0);
        fs::remove_all(folder_);
        fs::copy(whole_, folder_);
    }

    void put(const std::string& name, const std::string& text) const {
        std::ofstream(folder_ + "/" + name, std::ios::binary) << text;
    }
    [[nodiscard]] std::string get(const std::string& name) const { return read_file(folder_ + "/" + name); }

    void describe(const std::function<void(nlohmann::json&)>& change) const {
        auto description = nlohmann::json::parse(get("recording.json"));
        change(description);
        put("recording.json", description.dump());
    }

    /// Marks the recording as incomplete, as after a killed program, so that its checksums are not compared.
    void end_early() const {
        describe([](auto& d) { d["complete"] = false; });
    }

    void expect_refused(const std::string& reason) const {
        for (const char* command : {"replay ", "convert "}) {
            const auto result = tricoil(command + folder_);
            EXPECT_EQ(result.exit_code, 2) << result.err;
            EXPECT_THAT(result.err, HasSubstr(reason));
            EXPECT_EQ(std::count(result.err.begin(), result.err.end(), '\n'), 1);
        }
    }

    static inline std::string whole_;
    const std::string folder_ = path_in_temp("damaged");
};

TEST_F(Damage, AnyChangedByteIsFound) {
    for (const char* name : {"inputs.csv", "poses.csv", "events.csv"}) {
        SetUp();
        std::string text = get(name);
        text[text.size() / 2] = text[text.size() / 2] == '1' ? '2' : '1';
        put(name, text);
        expect_refused(std::string(name) + ": was changed since it was recorded");
        put(name, get(name).substr(0, 100));
        expect_refused(std::string(name) + ": was changed since it was recorded");
        fs::remove(folder_ + "/" + name);
        expect_refused(std::string(name) + ": cannot be opened");
    }
}

TEST_F(Damage, MissingLinesAreFound) {
    end_early();
    for (const char* name : {"inputs.csv", "poses.csv"}) {
        const std::string text = get(name);
        put(name, text.substr(0, text.find('\n') + 1));
        const auto replayed = tricoil("replay --json " + folder_);
        EXPECT_EQ(replayed.exit_code, 1) << replayed.err;
        EXPECT_FALSE(replayed.json()["bit_for_bit"]);
        put(name, text);
        EXPECT_EQ(tricoil("replay " + folder_).exit_code, 0);
    }
}

TEST_F(Damage, ForeignFoldersAndVersions) {
    put("recording.json", "{}");
    expect_refused("is not the description of a tricoil recording");
    put("recording.json", "binary \x01\x02");
    expect_refused("is not the description of a tricoil recording");
    fs::remove(folder_ + "/recording.json");
    expect_refused("is this a recording?");
    SetUp();
    describe([](auto& d) { d["version"] = 1; });
    expect_refused("recording format version 1; this program reads versions 3 and 4");
    fs::remove_all(folder_);
    expect_refused("does not exist");
}

TEST_F(Damage, InvalidSettings) {
    describe([](auto& d) { d["trackers"]["tracker"].erase("min_snr"); });
    expect_refused("trackers.tracker.min_snr: is missing");
    SetUp();
    describe([](auto& d) { d["trackers"]["tracker"]["min_snr"] = "many"; });
    expect_refused("trackers.tracker.min_snr: has a wrong type or value");
    SetUp();
    describe([](auto& d) { d["trackers"]["tracker"]["min_snr"] = -1; });
    expect_refused("trackers.tracker: ");
    SetUp();
    describe([](auto& d) { d["trackers"]["tracker"]["method"] = "scat"; });
    expect_refused("trackers.tracker.method: 'scat' is unknown; use direct, previous, scaat, dual-band");
    SetUp();
    describe([](auto& d) { d["trackers"]["tracker"].erase("method"); });
    expect_refused("trackers.tracker.method: is missing");
    SetUp();
    describe([](auto& d) { d["trackers"].erase("calibration"); });
    expect_refused("trackers.calibration: is missing");
    SetUp();
    describe([](auto& d) { d["trackers"]["tracker"]["new_one"] = 1; });
    expect_refused("has unknown keys");
    SetUp();
    describe([](auto& d) { d["trackers"]["sensors"] = 5; });
    expect_refused("sensors: must be 1 to 4");
}

/// They have one phase for each sensor channel, and no floor of the quadrature.
TEST_F(Damage, OlderRecordingsWithACalibrationAreReplayed) {
    const std::string coils = path_in_temp("coils.toml");
    std::ofstream(coils)
        << "version = 1\nmodel = \"concentric\"\n[source]\nmoment = [[0.005, 0, 0], [0, 0.005, 0], [0, 0, 0.005]]\n"
           "[sensor]\nsensitivity = [[1, 0, 0], [0, 1, 0], [0, 0, 1]]\nphase_rad = [0.01, -0.02, 0.03]\n";
    fs::remove_all(folder_);
    const auto run = tricoil("run --json --duration 0.5 --calibration " + coils + " --record " + folder_);
    ASSERT_EQ(run.exit_code, 0) << run.err;
    describe([](auto& d) {
        auto& known = d["trackers"]["calibration"];
        const nlohmann::json expected = {{0.01, 0.01, 0.01}, {-0.02, -0.02, -0.02}, {0.03, 0.03, 0.03}};
        EXPECT_EQ(known["phase_rad"], expected);
        known["phase_rad"] = {0.01, -0.02, 0.03};
        EXPECT_EQ(known.erase("calibrated_quadrature_floor"), 1U);
    });
    const auto replayed = tricoil("replay --json " + folder_);
    ASSERT_EQ(replayed.exit_code, 0) << replayed.err;
    EXPECT_TRUE(replayed.json()["bit_for_bit"]);
    describe([](auto& d) { d["trackers"]["calibration"]["phase_rad"] = {0.01, -0.02}; });
    expect_refused("trackers.calibration.phase_rad: has a wrong type or value");
}

/// The device's clock starts again, at times that it had before; all quadratures of the second part are 0.001.
TEST_F(Damage, RestsAfterARestartHaveTheirOwnQuadratures) {
    fs::remove_all(folder_);
    ASSERT_EQ(tricoil("run --json --scenario still --tracker direct --duration 2 --record " + folder_).exit_code, 0);
    end_early();
    const std::string poses = get("poses.csv");
    put("poses.csv", poses + poses.substr(poses.find('\n') + 1));
    std::istringstream inputs(get("inputs.csv"));
    std::string second;
    std::string line;
    for (std::getline(inputs, line); std::getline(inputs, line);) {
        auto fields = host::split(line, ',');
        const bool is_column = fields[0] == "column";
        for (std::size_t k = 0; k < fields.size(); ++k) {
            second += (k > 0 ? "," : "") + std::string(is_column && k >= 10 && k < 13 ? "0.001" : fields[k]);
        }
        second += "\n";
    }
    put("inputs.csv", get("inputs.csv") + second);
    const std::string rests = path_in_temp("rests.csv");
    const auto result = tricoil("convert " + folder_ + " --to rests --out " + rests);
    ASSERT_EQ(result.exit_code, 0) << result.err;
    std::istringstream lines(read_file(rests));
    std::getline(lines, line);
    for (const bool is_second : {false, true}) {
        ASSERT_TRUE(std::getline(lines, line)) << is_second;
        EXPECT_EQ(line.find(",0.001,0.001,0.001,0.001,0.001,0.001,0.001,0.001,0.001,") != std::string::npos, is_second) << line;
    }
    EXPECT_FALSE(std::getline(lines, line));
}

/// Recordings without gain steps and levels.
TEST_F(Damage, OlderRecordingsGiveTheSamePoses) {
    end_early();
    std::istringstream inputs(get("inputs.csv"));
    std::string older;
    for (std::string line; std::getline(inputs, line);) {
        for (int field = 0; field < 4; ++field) {
            line.erase(line.rfind(','));
        }
        older += line + "\n";
    }
    put("inputs.csv", older);
    describe([](auto& d) { d["version"] = 3; });
    const auto replayed = tricoil("replay --json " + folder_);
    ASSERT_EQ(replayed.exit_code, 0) << replayed.err;
    EXPECT_TRUE(replayed.json()["bit_for_bit"]);
}

/// Levels of a rest during which the gain changes are not known.
TEST_F(Damage, RestsHaveTheLevelsOfTheirColumns) {
    fs::remove_all(folder_);
    ASSERT_EQ(tricoil("run --json --scenario still --mux tdm --tracker direct --duration 2 --record " + folder_).exit_code, 0);
    end_early();
    const std::string inputs = get("inputs.csv");
    for (const bool gain_changes : {false, true}) {
        std::istringstream lines(inputs);
        std::string changed;
        int columns = 0;
        for (std::string line; std::getline(lines, line);) {
            if (line.starts_with("column,")) {
                const int step = gain_changes && ++columns > 700 ? 8 : 7;
                for (int field = 0; field < 4; ++field) {
                    line.erase(line.rfind(','));
                }
                line += ",#,16384,32768,8192";
                line.replace(line.find('#'), 1, std::to_string(step));
            }
            changed += line + "\n";
        }
        put("inputs.csv", changed);
        const std::string rests = path_in_temp("rests.csv");
        ASSERT_EQ(tricoil("convert " + folder_ + " --to rests --out " + rests).exit_code, 0);
        EXPECT_THAT(read_file(rests),
                    HasSubstr(gain_changes ? ",0,0,0,0,0,0,0,0,0,0\n" : ",0.25,0.25,0.25,0.5,0.5,0.5,0.125,0.125,0.125,7\n"));
    }
}

TEST_F(Damage, RestsLeaveOutColumnsWithoutACoil) {
    fs::remove_all(folder_);
    ASSERT_EQ(tricoil("run --json --scenario still --duration 1 --record " + folder_).exit_code, 0);
    end_early();
    put("inputs.csv", get("inputs.csv") + "column,0,1400000,0,1,1,0,1,1,1,1,1,1,1,1,1,0,0,0,0\n");
    const std::string rests = path_in_temp("rests.csv");
    const auto result = tricoil("convert " + folder_ + " --to rests --out " + rests);
    EXPECT_EQ(result.exit_code, 0) << result.err;
    EXPECT_EQ(result.out, rests + ": 1 rests\n");
    EXPECT_EQ(tricoil("convert --json " + folder_ + " --to rests --out " + rests).json()["rests"], 1);
}

TEST_F(Damage, ARecordingWithoutARestIsRefused) {
    const std::string rests = path_in_temp("no_rests.csv");
    const auto result = tricoil("convert " + folder_ + " --to rests --out " + rests);
    EXPECT_EQ(result.exit_code, 2);
    EXPECT_THAT(result.err, HasSubstr("the sensor never rests; hold it still for 0.5 s"));
    EXPECT_FALSE(fs::exists(rests));
}

/// A device or a named pipe in the place of a file has no end, or is never written.
TEST_F(Damage, FilesWithoutAnEndAreRefused) {
    for (const bool is_complete : {true, false}) {
        for (const char* name : {"recording.json", "inputs.csv", "poses.csv"}) {
            SetUp();
            if (!is_complete) {
                end_early();
            }
            fs::remove(folder_ + "/" + name);
            fs::create_symlink("/dev/zero", folder_ + "/" + name);
            const std::string reason = std::string(name) + ": is not a regular file";
            const auto device = run_program("timeout 20 " TRICOIL_PROGRAM " replay", folder_);
            EXPECT_EQ(device.exit_code, 2) << name;
            EXPECT_THAT(device.err, HasSubstr(reason));
            fs::remove(folder_ + "/" + name);
            ASSERT_EQ(std::system(("mkfifo " + folder_ + "/" + name).c_str()), 0);
            const auto pipe = run_program("timeout 20 " TRICOIL_PROGRAM " replay", folder_);
            EXPECT_EQ(pipe.exit_code, 2) << name;
            EXPECT_THAT(pipe.err, HasSubstr(reason));
        }
    }
}

TEST_F(Damage, APoseWithoutAnAttitudeIsRefused) {
    end_early();
    std::istringstream lines(get("poses.csv"));
    std::string text;
    int number = 0;
    for (std::string line; std::getline(lines, line); text += line + "\n") {
        if (++number == 50) {
            auto fields = host::split(line, ',');
            const std::string w(fields[9]);
            line.replace(line.find("," + w + ","), w.size() + 2, ",nan,");
        }
    }
    put("poses.csv", text);
    const auto result = tricoil("convert " + folder_ + " --to csv");
    EXPECT_EQ(result.exit_code, 2);
    EXPECT_THAT(result.err, HasSubstr("poses.csv:50: the attitude is not a number"));
}

TEST_F(Damage, AReplayGivesTheReasonOfAnIncompleteRecording) {
    end_early();
    EXPECT_THAT(tricoil("replay " + folder_).out, HasSubstr("incomplete: the recording program was killed, or could not write"));
    describe([](auto& d) { d["failure"] = "File too large"; });
    EXPECT_THAT(tricoil("replay " + folder_).out, HasSubstr("incomplete: File too large\n"));
}

TEST_F(Damage, InvalidLines) {
    end_early();
    const std::string inputs = get("inputs.csv");
    const auto refused_by_replay = [&](const std::string& line, const std::string& reason) {
        put("inputs.csv", inputs + line + "\n");
        const auto result = tricoil("replay " + folder_);
        EXPECT_EQ(result.exit_code, 2);
        EXPECT_THAT(result.err, HasSubstr(reason));
        EXPECT_THAT(result.err, HasSubstr("inputs.csv:"));
    };
    refused_by_replay("nonsense", "has 1 fields instead of 20");
    refused_by_replay("song,0,,,,,,,,,,,,,,,,,,", "unknown input kind 'song'");
    refused_by_replay("tick,1,100,,,,,,,,,,,,,,,,,", "sensor 1 does not exist; the recording has 1");
    refused_by_replay("tick,0,soon,,,,,,,,,,,,,,,,,", "'soon', is not a valid number");
    refused_by_replay("column,0,1,9,1,1,0,1,1,1,1,1,1,1,1,1,1,1,1,1", "must be less than 5");
    refused_by_replay("column,0,1,1,1,1,128,1,1,1,1,1,1,1,1,1,1,1,1,1", "field 7, '128', has unknown flags");
    refused_by_replay("column,0,1,1,1,1,0,1,1,1,1,1,1,1,1,1,12,1,1,1", "field 17 must be less than 12");
    refused_by_replay("column,0,1,1,1,1,0,1,1,1,1,1,1,1,1,1,1,65536,1,1", "field 18, '65536', is not a valid number");
    refused_by_replay("column,0,1,1,1,1,0,1,1,1,1,1,1,1,1,1,1,1", "has 18 fields instead of 20");
    refused_by_replay("column,0,1,1,1,1,0,1,1,1,1,1,1,1,1,1", "has 16 fields instead of 20");
    put("inputs.csv", "kind\n");
    EXPECT_THAT(tricoil("replay " + folder_).err, HasSubstr("inputs.csv:1: wrong header"));
}

TEST_F(Damage, TruePosesEndWhereTheyCannotBeUsed) {
    fs::remove_all(folder_);
    ASSERT_EQ(tricoil("run --json --duration 1 --record " + folder_).exit_code, 0);
    const std::string events = get("events.csv");
    const auto whole = tricoil("replay --json " + folder_);
    EXPECT_EQ(whole.err, "");
    EXPECT_GT(whole.json()["poses_scored"], 100U);
    end_early();
    const auto middle = events.rfind("truth,", events.rfind("\n7"));
    const auto expect_end = [&](const std::string& changed, const std::string& reason) {
        put("events.csv", changed);
        const auto cut = tricoil("replay --json " + folder_);
        EXPECT_EQ(cut.exit_code, 0) << cut.err;
        EXPECT_TRUE(cut.json()["bit_for_bit"]);
        EXPECT_THAT(cut.err,
                    ::testing::ContainsRegex("events.csv:[0-9]+: " + reason + ".*; later poses are without their true pose\n$"));
        EXPECT_EQ(std::count(cut.err.begin(), cut.err.end(), '\n'), 1);
        EXPECT_LT(cut.json()["poses_scored"], whole.json()["poses_scored"]);
    };
    const auto with = [&](const std::string& pose) {
        return events.substr(0, middle + 6) + pose + events.substr(events.find('\n', middle));
    };
    expect_end(events.substr(0, middle), "the recording was cut at 0\\.[67]");
    expect_end(with("nan 0 0 1 0 0 0"), "the true position is not finite");
    expect_end(with("1 0 0 1 1 0 0"), "the true position is not finite, or its quaternion is not a rotation");
    expect_end(with("1 0 0 1 0 0"), "has 6 fields instead of 7");
    expect_end(with("1 0 0 one 0 0 0"), "field 4, 'one', is not a valid number");
    describe([](auto& d) { d["source"]["truth_frame"] = "aligned"; });
    expect_end(events, "true poses of another frame");
    EXPECT_TRUE(tricoil("replay --json " + folder_).json()["position_rms_m"].is_null());
}

TEST_F(Damage, ALineCutOffIsNotRead) {
    end_early();
    put("inputs.csv", get("inputs.csv") + "column,0,12");
    put("poses.csv", get("poses.csv") + "0,99");
    const auto result = tricoil("replay --json " + folder_);
    EXPECT_EQ(result.exit_code, 0) << result.err;
    EXPECT_TRUE(result.json()["bit_for_bit"]);
}

TEST_F(Damage, ZerosAfterALossOfPowerAreNotRead) {
    end_early();
    const auto before = tricoil("replay --json " + folder_);
    ASSERT_EQ(before.exit_code, 0) << before.err;
    put("inputs.csv", get("inputs.csv") + std::string(100, '\0'));
    const auto after = tricoil("replay --json " + folder_);
    EXPECT_EQ(after.exit_code, 0) << after.err;
    EXPECT_EQ(after.out, before.out);
}

TEST_F(Damage, AKilledRecordingWithoutALineIsEmpty) {
    end_early();
    for (const char* name : {"inputs.csv", "poses.csv", "events.csv"}) {
        put(name, "");
    }
    const auto converted = tricoil("convert " + folder_);
    EXPECT_EQ(converted.exit_code, 0) << converted.err;
    EXPECT_EQ(converted.out, "");
    const auto replayed = tricoil("replay --json " + folder_);
    EXPECT_EQ(replayed.exit_code, 0) << replayed.err;
    EXPECT_EQ(replayed.json()["poses"], 0);
}

TEST_F(Damage, ARefusedConversionLeavesNoFile) {
    end_early();
    put("poses.csv", get("poses.csv") + "0,nonsense\n");
    const std::string out = path_in_temp("converted");
    for (const char* form : {"jsonl", "csv", "mat", "mcap", "openigtlink"}) {
        EXPECT_EQ(tricoil("convert " + folder_ + " --to " + form + " --out " + out).exit_code, 2);
        EXPECT_FALSE(fs::exists(out)) << form;
    }
    put("inputs.csv", get("inputs.csv") + "nonsense\n");
    EXPECT_EQ(tricoil("replay " + folder_ + " --out " + out).exit_code, 2);
    EXPECT_FALSE(fs::exists(out));
    const auto beside = fs::directory_iterator(fs::path(out).parent_path());
    EXPECT_EQ(std::count_if(begin(beside), end(beside), [&](const auto& e) { return e.path().string().starts_with(out); }), 0);
}

TEST_F(Damage, AnotherPoseIsADifference) {
    end_early();
    std::string poses = get("poses.csv");
    const auto digit = poses.rfind('.') + 1;
    poses[digit] = poses[digit] == '1' ? '2' : '1';
    put("poses.csv", poses);
    const auto result = tricoil("replay " + folder_);
    EXPECT_EQ(result.exit_code, 1);
    EXPECT_THAT(result.err, HasSubstr("replay differs, first at "));
}

}  // namespace
}  // namespace tricoil::test
