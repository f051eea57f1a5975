#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <algorithm>
#include <bit>
#include <cmath>
#include <random>
#include <sstream>

#include "tests/cli/cli_runner.hpp"

namespace tricoil::test {
namespace {

using ::testing::HasSubstr;

std::string replaced(std::string text, const std::string& from, const std::string& to) {
    const std::size_t at = text.find(from);
    EXPECT_NE(at, std::string::npos);
    return text.replace(at, from.size(), to);
}

constexpr const char* kOptions = " --carrier-hz 10000 --rate-hz 200000 ";

/// Recording with the reference on channel 1, given couplings, 16-bit unsigned codes and noise.
std::string recording(const Eigen::Matrix3d& x, int repeats, double noise) {
    std::ostringstream text;
    text << "state,repeat,sample,adc0,adc1,adc2,adc3\n";
    std::mt19937_64 random(1);
    std::normal_distribution<double> normal(0, noise);
    for (int repeat = 0; repeat < repeats; ++repeat) {
        for (int j = 0; j < 3; ++j) {
            for (int n = 0; n < 200; ++n) {
                const double angle = 2 * M_PI * 0.05 * n + 0.3 * repeat;
                text << "S" << j + 1 << "," << repeat << "," << n;
                for (int channel = 0; channel < 4; ++channel) {
                    const int row = channel == 0 ? 0 : channel - 1;
                    const double value = channel == 1 ? std::cos(angle) : x(row, j) * std::cos(angle + 0.4 + 0.05 * row);
                    text << "," << std::lround(32768 + 9000 * value + normal(random));
                }
                text << "\n";
            }
        }
    }
    return text.str();
}

Eigen::Matrix3d dipole() {
    const Eigen::Vector3d u = Eigen::Vector3d(1, 2, -1).normalized();
    const Eigen::Matrix3d rotation = Eigen::AngleAxisd(0.8, Eigen::Vector3d(1, 1, 0).normalized()).toRotationMatrix();
    return 0.2 * rotation * (1.5 * u * u.transpose() - 0.5 * Eigen::Matrix3d::Identity());
}

TEST(Demodulate, FindsReferenceMatrixAndScatter) {
    const auto result = tricoil("demodulate --json " + write_file("good.csv", recording(dipole(), 8, 20)) + kOptions);
    ASSERT_EQ(result.exit_code, 0) << result.err;
    const auto json = result.json();
    EXPECT_EQ(json["reference_channel"], 1);
    EXPECT_EQ(json["sensor_channels"], nlohmann::json({0, 2, 3}));
    for (std::size_t i = 0; i < 3; ++i) {
        for (std::size_t j = 0; j < 3; ++j) {
            const auto row = static_cast<Eigen::Index>(i);
            const auto column = static_cast<Eigen::Index>(j);
            EXPECT_NEAR(json["mean"][i][j].get<double>(), dipole()(row, column), 5e-4);
            EXPECT_NEAR(json["scatter"][i][j].get<double>(), 20 * 0.1 / 9000, 2e-4);
        }
    }
    EXPECT_GT(json["determinant"].get<double>(), 0);
    EXPECT_NEAR(json["estimated_sigma"].get<double>(), 20 * 0.1 / 9000, 0.3e-4);
    EXPECT_TRUE(json["flags"].empty());
}

TEST(Demodulate, ReportsAMissingSensor) {
    const auto alike =
        tricoil("demodulate " + write_file("alike.csv", recording(0.1 * Eigen::Matrix3d::Ones(), 8, 20)) + kOptions);
    EXPECT_EQ(alike.exit_code, 1);
    EXPECT_THAT(alike.err, HasSubstr("no sensor"));
    const auto silent = tricoil("demodulate " + write_file("silent.csv", recording(Eigen::Matrix3d::Zero(), 8, 20)) + kOptions);
    EXPECT_EQ(silent.exit_code, 1);
    EXPECT_THAT(silent.err, HasSubstr("no sensor"));
}

TEST(Demodulate, NamesEveryErrorWithItsLine) {
    const std::string good = recording(dipole(), 2, 20);
    const auto expect = [](const std::string& content, const std::string& says, const std::string& options = kOptions) {
        const auto result = tricoil("demodulate " + write_file("bad.csv", content) + options);
        EXPECT_EQ(result.exit_code, 2) << says;
        EXPECT_THAT(result.err, HasSubstr(says));
        EXPECT_EQ(std::count(result.err.begin(), result.err.end(), '\n'), 1) << result.err;
    };
    const auto header_end = good.find('\n') + 1;
    const std::string header = good.substr(0, header_end);
    expect("", "is empty");
    expect("a,b\n", "bad.csv: 2 channels; three sensor coils");
    expect(header, "no samples");
    expect(header + "S1,0,0,1,2,3\n", "bad.csv:2: 6 columns");
    expect(header + "S4,0,0,1,2,3,4\n", "bad.csv:2: state 'S4'");
    expect(header + "S1,0,0,1,2,nan,4\n", "bad.csv:2: adc2: 'nan' is not finite");
    expect(header + "S1,0,0,1,2,70000,4\n", "bad.csv:2: adc2: 70000 is not a whole number");
    expect(header + "S1,0,0,1,2,3,4\nS1,0,1,1,2,3.5,4\n", "bad.csv:3: adc2: 3.5 is not a whole number");
    expect(header + "S1,0,1,1,2,3,4\n", "sample 1 instead of 0");
    expect(good.substr(0, good.size() / 2), "");
    expect(good.substr(0, good.rfind("S3,1,199")), "199 samples, the first has 200");
    expect(good, "is -12151 ppm off", " --carrier-hz 10123 --rate-hz 200000");
    expect(good, "aliases", " --carrier-hz 95000 --rate-hz 200000");
    expect(good, "sample rate", " --carrier-hz 10000 --rate-hz nan");
    expect(good, "give the sample rate", " --carrier-hz 10000");
    expect(good, "no channel has a carrier of 20000 Hz", " --carrier-hz 20000 --rate-hz 200000");
    expect(good, "--bits", std::string(kOptions) + "--bits 99");
    expect(good, "guard", std::string(kOptions) + "--guard 200");
    expect(good, "2 carriers", " --carrier-hz 10000,12000 --rate-hz 200000");
    expect(good, "2 channels; three sensor coils", std::string(kOptions) + "--columns adc0,adc1");
    expect(good, "bad.csv:1: no column adc9; the header must have the channels",
           std::string(kOptions) + "--columns adc0,adc1,adc9");
    expect(good, "no column '9'; it has 7", std::string(kOptions) + "--reference 9");
    expect(good, "4 sensor channels; three are needed", std::string(kOptions) + "--reference none");
    expect(recording(dipole(), 1, 20), "1 complete repeats");
    expect(std::string("state\0,", 7), "binary");
}

TEST(Demodulate, InputsThatAreNoCapturesAreRefused) {
    for (const auto& [arguments, says] :
         {std::pair("/dev/zero", "/dev/zero:1: the line is longer"), std::pair("/no/such.csv", "/no/such.csv: cannot be opened"),
          std::pair("/", "/: is a folder"), std::pair("x.csv --bits 32", "--bits: 32 is not possible; give 8 to 31")}) {
        const auto result = tricoil(std::string("demodulate ") + arguments + kOptions);
        EXPECT_EQ(result.exit_code, 2) << arguments;
        EXPECT_THAT(result.err, HasSubstr(says));
        EXPECT_EQ(std::count(result.err.begin(), result.err.end(), '\n'), 1) << result.err;
    }
}

/// Three coils at the same time, of a generator whose clock differs, and an offset. Channels: three of the sensor, the current.
struct SimultaneousCoils {
    Eigen::Matrix3d x = dipole();
    double rate_hz = 1000;
    std::array<double, 3> carrier_hz{45, 65, 80};
    double offset_ppm = -450;
    double noise = 0.005;

    [[nodiscard]] std::vector<std::array<double, 4>> samples(int count) const {
        std::mt19937_64 random(3);
        std::normal_distribution<double> normal(0, noise);
        std::vector<std::array<double, 4>> result;
        for (int n = 0; n < count; ++n) {
            std::array<double, 4> sample{};
            for (std::size_t c = 0; c < 4; ++c) {
                sample[c] = 0.05 + 0.2 * normal(random);
                for (std::size_t j = 0; j < 3; ++j) {
                    const double phase =
                        2 * M_PI * carrier_hz[j] * (1 + 1e-6 * offset_ppm) * n / rate_hz + 0.5 * static_cast<double>(j);
                    const double share = c < 3 ? x(static_cast<Eigen::Index>(c), static_cast<Eigen::Index>(j)) : 1;
                    sample[c] += 0.25 * share * std::cos(phase + (c < 3 ? 0.2 : 0));
                }
            }
            result.push_back(sample);
        }
        return result;
    }
};

void expect_matrix(const nlohmann::json& json, const Eigen::Matrix3d& x, double scale, double tolerance) {
    for (std::size_t i = 0; i < 3; ++i) {
        for (std::size_t j = 0; j < 3; ++j) {
            EXPECT_NEAR(json["mean"][i][j].get<double>(), scale * x(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(j)),
                        tolerance)
                << i << j;
        }
    }
}

/// Text without a line of names: the channels in the given order, after a column of times.
std::string text_of(const std::vector<std::array<double, 4>>& samples, const std::vector<std::size_t>& order) {
    std::ostringstream text;
    for (std::size_t n = 0; n < samples.size(); ++n) {
        text << n;
        for (const std::size_t c : order) {
            text << " " << samples[n][c];
        }
        text << "\n";
    }
    return text.str();
}

constexpr const char* kThree = " --carriers 45,65,80 ";

TEST(Demodulate, ThreeCarriersAtOnce) {
    for (const double offset_ppm : {-450.0, 9900.0, -9900.0}) {
        SimultaneousCoils coils;
        coils.offset_ppm = offset_ppm;
        const auto samples = coils.samples(8000);
        const auto with = tricoil("demodulate --json --rate-hz 1000 --columns 4,2,3,5 " +
                                  write_file("all.txt", text_of(samples, {3, 1, 0, 2})) + kThree + "--reference 2");
        ASSERT_EQ(with.exit_code, 0) << with.err;
        EXPECT_EQ(with.json()["channels"], nlohmann::json({"column 4", "column 2", "column 3", "column 5"}));
        EXPECT_EQ(with.json()["reference_channel"], 1);
        expect_matrix(with.json(), dipole(), 1, 1e-3);
        const auto without = tricoil("demodulate --json --rate-hz 1000 --columns 2,3,4 " +
                                     write_file("coils.txt", text_of(samples, {0, 1, 2})) + kThree);
        ASSERT_EQ(without.exit_code, 0) << without.err;
        EXPECT_TRUE(without.json()["reference_channel"].is_null());
        expect_matrix(without.json(), dipole(), 0.25, 3e-4);  // phases 0.2, 0.7 and 1.2 rad: the signs are those of the couplings
        for (const auto& carrier_ppm : without.json()["carrier_offset_ppm"]) {
            EXPECT_NEAR(carrier_ppm.get<double>(), offset_ppm, 100);
        }
    }
}

TEST(Demodulate, BlocksOfAnyLengthInVolts) {
    for (const int length : {101, 150, 197}) {
        std::ostringstream text;
        text << "state,repeat,sample,x,y,z,current\n";
        for (int block = 0; block < 12; ++block) {
            for (int n = 0; n < length; ++n) {
                const double phase = 2 * M_PI * 0.05 * (1 + 450e-6) * (block * length + n);
                text << "S" << block % 3 + 1 << "," << block / 3 << "," << n;
                for (int i = 0; i < 3; ++i) {
                    text << "," << 1.5 + 2 * dipole()(i, block % 3) * std::cos(phase + 0.3);
                }
                text << "," << 0.1 + 2 * std::cos(phase) << "\n";
            }
        }
        const auto result = tricoil("demodulate --json " + write_file("volts.csv", text.str()) + kOptions);
        ASSERT_EQ(result.exit_code, 0) << result.err;
        expect_matrix(result.json(), dipole(), 1, 1e-4);
        EXPECT_NEAR(result.json()["reference_amplitude"].get<double>(), 2, 1e-3);
        EXPECT_NEAR(result.json()["carrier_offset_ppm"][0].get<double>(), 450, 30);
    }
}

TEST(Demodulate, TheReferenceIsTheChannelThatIsEqualForAllCoils) {
    const std::string text = recording(4 * dipole(), 8, 20);  // up to 0.8 of the reference, but not for all coils
    const auto found = tricoil("demodulate --json " + write_file("near.csv", text) + kOptions);
    ASSERT_EQ(found.exit_code, 0) << found.err;
    EXPECT_EQ(found.json()["reference_channel"], 1);
    expect_matrix(found.json(), 4 * dipole(), 1, 1e-3);
    const std::string alike = recording(0.9 * Eigen::Matrix3d::Ones(), 8, 20);
    const auto unknown = tricoil("demodulate --json " + write_file("alike.csv", alike) + kOptions);
    EXPECT_EQ(unknown.exit_code, 2);
    EXPECT_THAT(unknown.err, HasSubstr("cannot identify the reference channel"));
}

/// Couplings that other commands take: time, sigma, and the sensor on its known place.
TEST(Demodulate, WritesCouplingsForOtherCommands) {
    SimultaneousCoils coils;
    const Eigen::Vector3d u = Eigen::Vector3d(0.4, 0.2, 0.1).normalized();
    coils.x = 0.6 * (1.5 * u * u.transpose() - 0.5 * Eigen::Matrix3d::Identity());
    coils.x.col(1) *= -1;
    const std::string out = path_in_temp("couplings.csv");
    const auto result = tricoil("demodulate --rate-hz 1000 --columns 2,3,4 --out " + out + " " +
                                write_file("coils.txt", text_of(coils.samples(4000), {0, 1, 2})) + kThree);
    ASSERT_EQ(result.exit_code, 0) << result.err;
    EXPECT_THAT(read_file(out), ::testing::StartsWith("time_us,sigma,x11,x12,x13,x21,x22,x23,x31,x32,x33,q11,"));
    const auto wiring = tricoil("calibrate wiring --at 0.4,0.2,0.1 " + out);
    EXPECT_EQ(wiring.exit_code, 1);
    EXPECT_THAT(wiring.out, HasSubstr("reversed"));
    EXPECT_THAT(wiring.err, HasSubstr("the wiring is not straight"));
    for (const char* const at : {"0.4,0.4,0.1", "0.4,0.2,0.2", "0.4,0.2,0"}) {
        const auto ambiguous = tricoil("calibrate wiring --at " + std::string(at) + " " + out);
        EXPECT_EQ(ambiguous.exit_code, 2) << at;
        EXPECT_THAT(ambiguous.err, HasSubstr("--at: several wirings give the same couplings")) << at;
    }
    const auto tracked = tricoil("run --json --device couplings:" + out + ",mux=fdm");
    EXPECT_EQ(tracked.exit_code, 0) << tracked.err;
}

enum class WavKind { bits16, bits24, bits32, floating, compressed };

std::string little_endian(std::uint64_t value, int bytes) {
    std::string text;
    for (int n = 0; n < bytes; ++n) {
        text += static_cast<char>(value >> (8 * n));
    }
    return text;
}

/// Channels in the given order, -1: silence.
std::string wav_of(const std::vector<std::array<double, 4>>& samples, WavKind kind, const std::vector<int>& order,
                   int rate_hz = 1000) {
    const int bits = kind == WavKind::bits16 ? 16 : kind == WavKind::bits24 ? 24 : 32;
    const int channels = static_cast<int>(order.size());
    std::string data;
    for (const auto& sample : samples) {
        for (const int c : order) {
            const double value = c < 0 ? 0 : sample[static_cast<std::size_t>(c)];
            const auto code = kind == WavKind::floating ? std::bit_cast<std::uint32_t>(static_cast<float>(value))
                                                        : static_cast<std::uint64_t>(std::llround(std::ldexp(value, bits - 1)));
            data += little_endian(code, bits / 8);
        }
    }
    const int format = kind == WavKind::floating ? 3 : kind == WavKind::compressed ? 2 : 1;
    const std::string head = "WAVEfmt " + little_endian(16, 4) + little_endian(static_cast<std::uint64_t>(format), 2) +
                             little_endian(static_cast<std::uint64_t>(channels), 2) +
                             little_endian(static_cast<std::uint64_t>(rate_hz), 4) + little_endian(0, 6) +
                             little_endian(static_cast<std::uint64_t>(bits), 2) + "LIST" + little_endian(3, 4) + "abc" +
                             std::string(1, '\0') + "data" + little_endian(data.size(), 4);
    return "RIFF" + little_endian(head.size() + data.size(), 4) + head + data;
}

TEST(Demodulate, WavFilesOfAllFormats) {
    const auto samples = SimultaneousCoils{}.samples(6000);
    for (const WavKind kind : {WavKind::bits16, WavKind::bits24, WavKind::bits32, WavKind::floating}) {
        const auto result = tricoil("demodulate --json --columns 4,2,1,5 --reference 5 " +
                                    write_file("a.wav", wav_of(samples, kind, {2, 1, -1, 0, 3})) + kThree);
        ASSERT_EQ(result.exit_code, 0) << static_cast<int>(kind) << result.err;
        EXPECT_EQ(result.json()["rate_hz"], 1000);
        expect_matrix(result.json(), dipole(), 1, 1e-3);
    }
}

TEST(Demodulate, BadWavFilesAreRefused) {
    const auto samples = SimultaneousCoils{}.samples(3000);
    const auto expect = [](const std::string& content, const std::string& says, const std::string& options = kThree) {
        const auto result = tricoil("demodulate " + write_file("bad.wav", content) + options);
        EXPECT_EQ(result.exit_code, 2) << says;
        EXPECT_THAT(result.err, HasSubstr("bad.wav: "));
        EXPECT_THAT(result.err, HasSubstr(says));
        EXPECT_EQ(std::count(result.err.begin(), result.err.end(), '\n'), 1) << result.err;
    };
    const std::string good = wav_of(samples, WavKind::bits16, {0, 1, 2, 3});
    expect(wav_of(samples, WavKind::bits16, {0, 1}), "2 channels; three sensor coils are needed");
    expect(wav_of(samples, WavKind::compressed, {0, 1, 2}), "is a compressed WAV file (format 2)");
    expect(good.substr(0, good.size() - 3), "ends in the middle of a frame");
    expect(good.substr(0, 30), "ends in the middle");
    expect(replaced(good, little_endian(24000, 4), little_endian(24001, 4)), "ends in the middle of a frame of 4 channels");
    expect(replaced(good, "WAVE", "AVI "), "is a RIFF file, but not WAVE");
    expect(replaced(good, "fmt ", "FMT "), "the WAV header has no format");
    expect(good, "1 carriers", " --carrier-hz 45");
}

TEST(Demodulate, BadSignalsAreRefused) {
    SimultaneousCoils coils;
    const auto expect = [](const std::vector<std::array<double, 4>>& samples, const std::string& says,
                           const std::string& options = kThree) {
        const auto result =
            tricoil("demodulate " + write_file("s.wav", wav_of(samples, WavKind::floating, {0, 1, 2, 3})) + options);
        EXPECT_EQ(result.exit_code, 2) << says;
        EXPECT_THAT(result.err, HasSubstr(says));
        EXPECT_EQ(std::count(result.err.begin(), result.err.end(), '\n'), 1) << result.err;
    };
    const auto good = coils.samples(6000);
    expect(good, "aliases", " --carriers 45,65,480");
    expect(good, "only 1 Hz apart; blocks of 100 samples cannot separate them, 2000 or more can",
           " --carriers 45,65,66 --block 100");
    expect(good, "two frequencies are equal", " --carriers 45,65,65");
    expect({good.begin(), good.begin() + 100}, "holds no samples, or fewer than a block of 267");
    expect(std::vector<std::array<double, 4>>(6000), "no channel has a carrier of 45 Hz: silence");
    auto clipped = good;
    for (auto& sample : clipped) {
        for (double& value : sample) {
            value = std::clamp(8 * value, -1.0, 1.0);
        }
    }
    expect(clipped, "every block of channel 4 is clipped");
    auto dropped = good;
    for (std::size_t n = 4500; n < dropped.size(); ++n) {
        dropped[n][3] = 0;
    }
    expect(dropped, "the reference drops out in repeat 1");
    coils.offset_ppm = 15'000;
    expect(coils.samples(6000), "ppm off, more than 10000");
}

/// For at most 20 s.
std::string wait_for_lines(const std::string& path, int count) {
    return "for n in $(seq 200); do test $(wc -l < " + path + ") -ge " + std::to_string(count) + " && break; sleep 0.1; done";
}

/// A stream of unknown length, and a file that grows: rows appear before its end.
TEST(Demodulate, FollowsAStreamAndAGrowingFile) {
    std::string wav = wav_of(SimultaneousCoils{}.samples(8000), WavKind::bits16, {0, 1, 2, 3});
    const std::string length = little_endian(64000, 4);
    wav = replaced(wav, "data" + length, "data" + little_endian(0xFFFF'FFFF, 4));
    const std::string path = write_file("stream.wav", wav);
    const std::string arguments = std::string(kThree) + "--reference 4 --json";
    const auto result = run_program("sh -c 'cat " + path + " | " + TRICOIL_PROGRAM + " demodulate - " + arguments + "'", "");
    ASSERT_EQ(result.exit_code, 0) << result.err;
    expect_matrix(result.json(), dipole(), 1, 1e-3);
    const std::string growing = write_file("growing.wav", wav.substr(0, wav.size() / 2));
    const std::string rest = write_file("rest.wav", wav.substr(wav.size() / 2));
    const std::string rows = path_in_temp("rows");
    const auto followed =
        run_program("sh -c '" TRICOIL_PROGRAM " demodulate --follow --out - " + growing + arguments + " > " + rows + " & " +
                        wait_for_lines(rows, 11) + "; wc -l < " + rows + "; cat " + rest + " >> " + growing + "; " +
                        wait_for_lines(rows, 30) + "; kill -INT $!; wait $!; wc -l < " + rows + "'",
                    "");
    EXPECT_EQ(followed.exit_code, 0) << followed.err;
    int early = 0;
    int all = 0;
    std::istringstream(followed.out) >> early >> all;
    EXPECT_GT(early, 10) << followed.out;
    EXPECT_EQ(all, 1 + 8000 / 267) << followed.out;
}

}  // namespace
}  // namespace tricoil::test
