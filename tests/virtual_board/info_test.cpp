// The flash image on a pseudo terminal: `tricoil device` and its effect on `tricoil run`.
#include <gmock/gmock.h>

#include <cstdlib>
#include <cstring>
#include <fstream>
#include <nlohmann/json.hpp>
#include <sstream>

#include "core/base/crc32.hpp"
#include "core/calibration/blob.hpp"
#include "tests/device/program_folder.hpp"
#include "tests/support/csv_table.hpp"

namespace tricoil {
namespace {

using nlohmann::json;
using ::testing::Contains;
using ::testing::HasSubstr;

class DeviceInfo : public test::ProgramFolder {
protected:
    /// Starts the board with these faults, and waits for its serial line.
    void plug_in(const std::string& options) {
        board_ = std::make_unique<test::Program>(TRICOIL_VIRTUAL_BOARD " " TRICOIL_BOARD_IMAGE ".bin --serial --report " +
                                                 in("report.json") + " " + options + " >" + in("line") + " 2>" + in("board.err"));
        ASSERT_TRUE(test::eventually([&] { return test::read_text(in("line")).find('\n') != std::string::npos; }))
            << test::read_text(in("board.err"));
        const std::string line = test::read_text(in("line"));  // serial /dev/pts/0
        device_ = "serial:" + line.substr(line.find(' ') + 1, line.find('\n') - line.find(' ') - 1);
    }
    json info() {
        EXPECT_EQ(tricoil("device info --json " + device_), 0) << err;
        return json::parse(out);
    }
    bool eventually_info(const std::function<bool(const json&)>& is_so) {
        for (int n = 0; n < 200; ++n) {  // no answer while the board restarts
            if (tricoil("device info --json " + device_) == 0 && is_so(json::parse(out))) {
                return true;
            }
        }
        return false;
    }

    [[nodiscard]] test::CsvTable poses() const { return test::CsvTable(test::read_text(in("poses.csv"))); }

    std::string device_;

private:
    std::unique_ptr<test::Program> board_;
};

TEST_F(DeviceInfo, ShowsThePlaceOfAProgramError) {
    plug_in("--fault bad_access@0.6");
    ASSERT_TRUE(eventually_info([](const json& now) { return !now["crash"].is_null(); }));
    const json now = info();
    EXPECT_EQ(now["reset_reason"], "program error");
    EXPECT_EQ(now["crash"]["reason"], "processor fault");
    EXPECT_EQ(now["crash"]["exception"], "HardFault");
    EXPECT_EQ(now["crash"]["address"], "0x30000000");
    EXPECT_EQ(now["crash"]["cfsr"], "0x00008200");
    EXPECT_EQ(now["crash"]["count"], 1);
    EXPECT_EQ(now["image"], "sound");
    EXPECT_NEAR(now["supply_v"].get<double>(), 3.3, 0.01);
    EXPECT_NEAR(now["temperature_c"].get<double>(), 30, 1.5);
    EXPECT_THAT(now["warnings"], Contains(HasSubstr("arm-none-eabi-addr2line")));
    ASSERT_EQ(tricoil("device info " + device_), 0) << err;
    EXPECT_THAT(out, HasSubstr("processor fault, exception HardFault, pc 0x0803"));
    EXPECT_THAT(out, HasSubstr("\nwarning: a program error restarted the device"));
}

TEST_F(DeviceInfo, ShowsTheLevelsOfEveryChannelLive) {
    plug_in("--scenario still");
    ASSERT_TRUE(eventually_info([](const json&) { return true; }));
    ASSERT_EQ(tricoil("device watch --levels --json --duration 3 " + device_), 0) << err;
    std::istringstream lines(out);
    int rows = 0;
    std::string heading;
    std::getline(lines, heading);
    for (const json& peak : json::parse(heading)["reference_at_start_v"]) {
        EXPECT_NEAR(peak.get<double>(), 0.66, 0.04) << heading;
    }
    for (std::string line; std::getline(lines, line); ++rows) {
        const json row = json::parse(line);
        EXPECT_EQ(row["coil"], rows % 3 + 1);
        ASSERT_GT(row["columns"], 2) << line << ": a slow machine has fewer than 80";
        EXPECT_EQ(row["saturated"], 0);
        double snr_db = 0;
        for (std::size_t i = 0; i < 3; ++i) {
            EXPECT_LT(row["level"][i], 1);
            EXPECT_GT(row["noise"][i], 0);
            snr_db = std::max(snr_db, row["snr_db"][i].get<double>());
        }
        EXPECT_GT(snr_db, 70) << line;
    }
    EXPECT_GE(rows, 6);
    ASSERT_EQ(tricoil("device watch --levels --duration 0.4 " + device_), 0) << err;
    EXPECT_THAT(out, HasSubstr("at the start: reference 0.6"));
    EXPECT_THAT(out, HasSubstr("V (S1 S2 S3)\nS1  gain step"));
    ASSERT_EQ(tricoil("device mode --mux fdm " + device_), 0) << err;
    ASSERT_EQ(tricoil("device watch --levels --duration 0.4 " + device_), 0) << err;
    EXPECT_THAT(out, HasSubstr("V (all coils together)\nS1  gain step"));
    ASSERT_EQ(tricoil("device mode --mux tdm " + device_), 0) << err;
    ASSERT_EQ(tricoil("run --duration 0.5 --device " + device_ + " --out " + in("poses.csv")), 0) << err;
    EXPECT_GT(poses().rows(), 10U) << "the device sends poses again";
}

TEST_F(DeviceInfo, LevelsEndWithTheNamesOfTheFaults) {
    plug_in("--scenario still --fault open_coil:S2@1");
    ASSERT_TRUE(eventually_info([](const json&) { return true; }));
    EXPECT_EQ(tricoil("device watch --levels --duration 30 " + device_), 3);
    EXPECT_THAT(err, HasSubstr("the device reports: "));
    EXPECT_THAT(err, HasSubstr("open coil: no current while it is driven"));
    EXPECT_EQ(std::count(err.begin(), err.end(), '\n'), 1) << err;
}

TEST_F(DeviceInfo, WarnsOfOptionBytesWithTheRemedy) {
    plug_in("--fault option_bytes:0xFFAFF8BB");
    const json now = info();
    EXPECT_EQ(now["options"], "0xffaff8bb");
    EXPECT_EQ(now["read_protection"], 1);
    for (const char* const remedy : {"-ob BOR_LEV=4", "-ob RDP=0xAA", "-ob DBANK=1"}) {
        EXPECT_THAT(now["warnings"], Contains(HasSubstr(remedy)));
    }
    EXPECT_EQ(now["warnings"].size(), 3U);
}

TEST_F(DeviceInfo, LoaderAndCalibrationNeedTheButton) {
    const auto blob = calibration::encode(calibration::Calibration<double>{});
    std::ofstream(in("cal.bin"), std::ios::binary).write(reinterpret_cast<const char*>(blob.begin()), std::ssize(blob));
    plug_in("--fault option_bytes:0xFFEFFCAA --fault button@4-4.2");
    for (const std::string& command : {"device loader " + device_, "device write-calibration " + device_ + " " + in("cal.bin")}) {
        EXPECT_EQ(tricoil(command), 3);
        EXPECT_THAT(err, HasSubstr("refused without permission; press the button of the device (B1, blue)"));
        EXPECT_EQ(std::count(err.begin(), err.end(), '\n'), 1) << err;
    }
    EXPECT_THAT(info()["warnings"], ::testing::IsEmpty());
    ASSERT_TRUE(eventually_info([](const json& now) { return now["permission_s"] > 0; }));
    EXPECT_EQ(tricoil("device write-calibration " + device_ + " " + in("cal.bin")), 0) << err;
    EXPECT_EQ(info()["permission_s"], 0);
    EXPECT_EQ(tricoil("device loader " + device_), 3) << "one press is for one command";
}

/// A sealed image whose program hangs: header and nothing else. The update of the whole image is in update_test.cpp.
std::string image_that_hangs() {
    constexpr std::size_t kProgram = 0x2000;
    constexpr std::size_t kHeader = 0x2200;
    std::string image = test::read_text(TRICOIL_BOARD_IMAGE ".bin").substr(0, kHeader + 200);
    const auto put = [&](std::size_t at, std::uint32_t word) { std::memcpy(image.data() + at, &word, sizeof word); };
    put(kProgram + 4, 0x08000000 + kHeader + 100 + 1);
    put(kHeader + 100, 0xE7FEE7FE);
    put(kHeader + 12, 0x08000000 + static_cast<std::uint32_t>(image.size()));
    put(kHeader + 48, 0);
    put(kHeader + 48, crc32(std::vector<std::uint8_t>(image.begin() + kProgram, image.end())));
    return image;
}

TEST_F(DeviceInfo, AnImageThatDoesNotStartIsReported) {
    std::string image = image_that_hangs();
    std::ofstream(in("hangs.bin"), std::ios::binary) << image;
    image.back() ^= 1;
    std::ofstream(in("damaged.bin"), std::ios::binary) << image;
    plug_in("--fault option_bytes:0xFFEFFCAA --fault button@6-6.2");
    EXPECT_EQ(tricoil("device update " + device_ + " " + in("damaged.bin")), 2);
    EXPECT_THAT(err, HasSubstr("damaged.bin: the image is damaged"));
    EXPECT_EQ(tricoil("device update " + device_ + " " + in("hangs.bin")), 3);
    EXPECT_THAT(err, HasSubstr("write image: refused without permission; press the button"));
    const std::string crc = info()["image_crc"];
    ASSERT_TRUE(eventually_info([](const json& now) { return now["permission_s"] > 0; }));
    EXPECT_EQ(tricoil("device update " + device_ + " " + in("hangs.bin")), 3);
    EXPECT_THAT(err, HasSubstr("the new image did not start, and the device runs its old one again"));
    EXPECT_EQ(std::count(err.begin(), err.end(), '\n'), 1) << err;
    EXPECT_EQ(info()["image_crc"], crc);
}

TEST_F(DeviceInfo, ShowsNoProgramErrorAfterPowerOn) {
    plug_in("");
    const json now = info();
    EXPECT_EQ(now["reset_reason"], "power-on");
    EXPECT_TRUE(now["crash"].is_null());
    ASSERT_EQ(tricoil("device info " + device_), 0) << err;
    EXPECT_THAT(out, HasSubstr("crash          none since power-on"));
}

TEST_F(DeviceInfo, ConfigurationIsSetSavedDumpedAndRestored) {
    plug_in("--scenario still --fault button@6-6.3 --fault button@20-20.3");
    ASSERT_EQ(tricoil("device config get --wait 20 " + device_), 0) << err;
    EXPECT_THAT(out, HasSubstr(": defaults\nversion = 1\nnode = 0\n"));
    ASSERT_EQ(tricoil("run --device " + device_ + " --duration 0.3 --out " + in("poses.csv")), 0) << err;
    EXPECT_THAT(err, HasSubstr("no half space of the sensor is stored: +x; to set it: tricoil device config set " + device_));
    ASSERT_EQ(tricoil("device config set " + device_ + " node=3 name=left hemisphere=-1/0/0"), 0) << err;
    EXPECT_THAT(out, HasSubstr("tricoil device config save " + device_));
    ASSERT_EQ(tricoil("run --device " + device_ + " --duration 0.5 --out " + in("poses.csv")), 0) << err;
    EXPECT_THAT(err, Not(HasSubstr("half space")));
    EXPECT_LT(poses().number(poses().rows() - 1, "x_m"), 0) << "the remembered half space";
    ASSERT_EQ(tricoil("device config dump " + device_ + " " + in("kept.toml")), 0) << err;
    EXPECT_THAT(test::read_text(in("kept.toml")), HasSubstr("not saved\nversion = 1\nnode = 3\n"));
    ASSERT_TRUE(eventually_info([](const json& now) { return now["permission_s"] > 0; }));
    ASSERT_EQ(tricoil("device config save " + device_), 0) << err;
    ASSERT_EQ(tricoil("device config set " + device_ + " node=4"), 0) << err;
    EXPECT_EQ(tricoil("device config restore " + device_ + " " + in("kept.toml")), 3) << "one press is for one command";
    EXPECT_THAT(err, HasSubstr("save parameters: refused without permission"));
    ASSERT_EQ(tricoil("device config get " + device_), 0) << err;
    EXPECT_THAT(out, HasSubstr("node = 3"));
    EXPECT_THAT(out, HasSubstr("name = \"left\""));
}

/// Refused with one line and exit code 2, before the device is asked.
TEST_F(DeviceInfo, BadConfigurationIsRefused) {
    const std::string whole =
        "version = 1\nnode = 3\nbit_rate = 1000000\ndata_bit_rate = 5000000\nstart = 0\nmode = 0\n"
        "confined = 0\nhemisphere = \"\"\nname = \"left\"\n";
    const auto replaced = [&](const std::string& a, const std::string& b) {
        std::string text = whole;
        return text.replace(text.find(a), a.size(), b);
    };
    for (const auto& [text, message] : std::initializer_list<std::pair<std::string, const char*>>{
             {whole.substr(0, whole.size() - 14), "'name' is missing; is the file cut short?"},
             {whole.substr(0, whole.size() - 2), "kept.toml:9: "},
             {"", "is missing"},
             {whole + "nodes = 3\n", "kept.toml:10: 'nodes' is not a known key; did you mean 'node'?"},
             {replaced("node = 3", "node = 16"), "kept.toml:2: 'node' must be 0 to 15"},
             {replaced("node = 3", "node = -1"), "kept.toml:2: 'node' must be a whole number"},
             {replaced("node = 3", "node = \"3\""), "kept.toml:2: 'node' must be a whole number"},
             {replaced("bit_rate = 1000000", "bit_rate = 300000"), "kept.toml:3: 'bit_rate' must be 125000"},
             {replaced("data_bit_rate = 5000000", "data_bit_rate = 0"), "'data_bit_rate' must be 2500000 or 5000000"},
             {replaced("start = 0", "start = 3"), "'start' must be 0 (idle at power-on)"},
             {replaced("name = \"left\"", "name = \"a name with blanks\""), "'name' must have at most 16 ASCII characters"},
             {replaced("hemisphere = \"\"", "hemisphere = \"1/0\""), "hemisphere must be a direction X/Y/Z"},
             {replaced("hemisphere = \"\"", "hemisphere = \"inf/0/0\""), "hemisphere must be a direction X/Y/Z"},
             {replaced("version = 1", "version = 2"), "kept.toml:1: 'version' must be 1; the file is for other firmware"}}) {
        std::ofstream(in("kept.toml")) << text;
        EXPECT_EQ(tricoil("device config restore serial:/dev/null " + in("kept.toml")), 2) << text;
        EXPECT_THAT(err, HasSubstr(message));
        EXPECT_EQ(std::count(err.begin(), err.end(), '\n'), 1) << err;
    }
    for (const std::string words : {"set serial:/dev/null", "set serial:/dev/null node", "set serial:/dev/null nod=3",
                                    "set serial:/dev/null node=1 node=2", "get serial:/dev/null x", "save serial:/dev/null x",
                                    "dump serial:/dev/null", "restore serial:/dev/null", "put serial:/dev/null"}) {
        EXPECT_EQ(tricoil("device config " + words), 2) << words;
        EXPECT_THAT(err, HasSubstr("tricoil: ")) << words;
    }
}

TEST_F(DeviceInfo, ModeIsSetAndPrinted) {
    plug_in("");
    ASSERT_EQ(tricoil("device mode --wait 20 --mux fdm --rate-hz 240 --columns " + device_), 0) << err;
    EXPECT_THAT(out, HasSubstr(device_ + ": front end, fdm, 2"));  // the rate that the timers reach
    EXPECT_EQ(tricoil("device mode --rate-hz 960 " + device_), 3) << "TDM does not reach 960 frames/s";
    EXPECT_THAT(err, HasSubstr("this mode: refused: invalid value"));
    EXPECT_EQ(tricoil("device mode --mux both " + device_), 2);
    EXPECT_EQ(tricoil("device mode --rate-hz -1 " + device_), 2);
}

TEST_F(DeviceInfo, BoresightAndHemisphereActOnThePoses) {
    plug_in("--scenario still");
    ASSERT_EQ(tricoil("device boresight " + device_), 0) << err;
    ASSERT_EQ(tricoil("device hemisphere --towards -1,0,0 " + device_), 0) << err;
    ASSERT_EQ(tricoil("run --device " + device_ + " --duration 0.5 --out " + in("poses.csv")), 0) << err;
    ASSERT_GT(poses().rows(), 10U);
    EXPECT_LT(poses().number(poses().rows() - 1, "x_m"), 0);
    EXPECT_EQ(tricoil("device hemisphere --towards 1,2 " + device_), 2);
    EXPECT_EQ(tricoil("device hemisphere --towards nan,0,0 " + device_), 2);
    ASSERT_EQ(tricoil("device boresight --clear " + device_), 0) << err;
}

}  // namespace
}  // namespace tricoil
