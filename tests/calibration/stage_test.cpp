// `tricoil calibrate` and `tricoil evaluate` on generated data sets in ILEMT text format.
#include <fmt/format.h>
#include <fmt/ranges.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <numbers>
#include <random>
#include <sstream>

#include "core/calibration/blob.hpp"
#include "core/field/general_dipole.hpp"
#include "core/geometry/rotations.hpp"
#include "core/linear/eigen.hpp"
#include "core/linear/quaternion.hpp"
#include "tests/cli/cli_runner.hpp"
#include "tests/support/triads/data_set.hpp"

namespace tricoil::test {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;

/// Source coils 45 mm apart, axes 3 deg from orthogonal, winding radius 20 mm; three files to calibrate and three to test.
class Stage : public ::testing::Test {
protected:
    static void SetUpTestSuite() {
        folder_ = path_in_temp("stage");
        fs::create_directories(folder_);
        triads_ = new sim::RealTriads(sim::make_triads(0.045, 3, 0.02, 9));
        sim::StageParams md;
        md.position_sigma_m = 5e-5;
        md.noise_share = 1e-4;
        md.turns_deg = {-90, 0, 90};
        sim::StageParams ld = md;
        ld.steps = 4;
        ld.half_width_m = 0.045;
        ld.turns_deg = {-60, 10, 70};
        ld.seed = 2;
        for (int fixture = 0; fixture < 3; ++fixture) {
            write(sim::ilemt_name(fixture, "md"), sim::ilemt_text(*triads_, md, fixture));
            write(sim::ilemt_name(fixture, "ld"), sim::ilemt_text(*triads_, ld, fixture));
        }
    }
    static void TearDownTestSuite() { delete triads_; }

    static void write(const std::string& name, const std::string& text) {
        std::ofstream(folder_ + "/" + name, std::ios::binary) << text;
    }
    static std::string path(const std::string& name) { return folder_ + "/" + name; }
    static std::string set(const std::string& suffix) {
        std::string files;
        for (int fixture = 0; fixture < 3; ++fixture) {
            files += " " + path(sim::ilemt_name(fixture, suffix));
        }
        return files;
    }
    static std::vector<std::string> lines_of(const std::string& name) {
        std::ifstream file(path(name));
        std::vector<std::string> lines;
        for (std::string line; std::getline(file, line);) {
            lines.push_back(line);
        }
        return lines;
    }
    static std::string joined(const std::vector<std::string>& lines) {
        std::string text;
        for (const std::string& line : lines) {
            text += line + "\n";
        }
        return text;
    }
    static void expect_refused(const CliResult& r, const std::string& what) {
        EXPECT_EQ(r.exit_code, 2) << r.out << r.err;
        EXPECT_THAT(r.err, HasSubstr(what));
        EXPECT_EQ(std::count(r.err.begin(), r.err.end(), '\n'), 1) << r.err;
    }

    static inline std::string folder_;
    static inline sim::RealTriads* triads_ = nullptr;
};

double number(const CliResult& r, const char* key) { return r.json()[key].get<double>(); }

TEST_F(Stage, WideCoilsConvergeFromTheDataAlone) {
    const std::string cal = path("wide.toml");
    const std::string blob = path("wide.bin");
    for (const char* model : {"general", "finite"}) {
        const auto fit =
            tricoil("calibrate stage --json --model " + std::string(model) + " --out " + cal + " --blob " + blob + set("md"));
        ASSERT_EQ(fit.exit_code, 0) << fit.err;
        const auto test = tricoil("evaluate --json --calibration " + cal + set("ld"));
        ASSERT_EQ(test.exit_code, 0) << test.err;
        std::cout << model << ": " << 1e3 * number(test, "position_rms_m") << " mm, " << number(test, "orientation_rms_deg")
                  << " deg\n";
        EXPECT_EQ(number(test, "poses_not_converged"), 0);
        EXPECT_LT(number(test, "position_rms_m"), std::string(model) == "finite" ? 1.5e-4 : 6e-4);
        EXPECT_LT(number(test, "orientation_rms_deg"), 0.1);
    }
    // The distances between the estimated source coils equal the simulated ones.
    const auto fit = tricoil("calibrate stage --json --model finite --out " + cal + " --blob " + blob + set("md"));
    const auto bytes = read_file(blob);
    const auto read = calibration::decode({reinterpret_cast<const std::uint8_t*>(bytes.data()), bytes.size()});
    ASSERT_TRUE(read.ok()) << read.status().message();
    const Mat3<double>& offset = read->model.source_offset_m;
    for (int j = 0; j < 3; ++j) {
        EXPECT_NEAR((offset.col(j) - offset.col((j + 1) % 3)).norm(), 0.045, 5e-4);
    }
}

TEST_F(Stage, OneFixtureAloneConvergesToo) {
    for (int fixture = 0; fixture < 3; ++fixture) {
        const auto fit = tricoil("calibrate stage --json --out " + path("one.toml") + " " + path(sim::ilemt_name(fixture, "md")));
        ASSERT_EQ(fit.exit_code, 0) << fit.err;
        EXPECT_LT(number(fit, "position_rms_m"), 5e-4) << fixture;
    }
}

TEST_F(Stage, ConcentricModelHasALargerResidualOnWideCoils) {
    const auto concentric = tricoil("calibrate stage --json --model concentric --out " + path("c.toml") + set("md"));
    const auto general = tricoil("calibrate stage --json --model general --out " + path("g.toml") + set("md"));
    ASSERT_EQ(concentric.exit_code, 0) << concentric.err;
    EXPECT_GT(number(concentric, "residual_rms"), 5 * number(general, "residual_rms"));
    const auto direct = tricoil("evaluate --json --solver direct --calibration " + path("c.toml") + set("ld"));
    EXPECT_EQ(direct.exit_code, 0);
    EXPECT_GT(number(direct, "position_rms_m"), 1e-3);
}

TEST_F(Stage, NamedFixturesAndRefitting) {
    const auto fit = tricoil("calibrate stage --json --fixtures named --out " + path("n.toml") + set("md"));
    ASSERT_EQ(fit.exit_code, 0) << fit.err;
    const auto test = tricoil("evaluate --json --calibration " + path("n.toml") + set("ld"));
    EXPECT_THAT(test.json()["fixtures"].get<std::string>(), "from the calibration");
    const auto refitted = tricoil("evaluate --json --refit-fixtures --calibration " + path("n.toml") + set("ld"));
    ASSERT_EQ(refitted.exit_code, 0) << refitted.err;
    EXPECT_THAT(refitted.json()["fixtures"].get<std::string>(), HasSubstr("refitted"));
    EXPECT_LT(number(refitted, "position_rms_m"), number(test, "position_rms_m"));
}

/// The source stands in other fixtures: the sensor is in another half space, and mostly along another axis, of its frame. The
/// calibration holds for the region of its poses, so errors may be larger elsewhere.
TEST_F(Stage, RefittingFindsAnyFixtureOfTheSource) {
    ASSERT_EQ(tricoil("calibrate stage --model finite --out " + path("r.toml") + set("md")).exit_code, 0);
    const double known = number(tricoil("evaluate --json --calibration " + path("r.toml") + set("md")), "position_rms_m");
    for (const Vec3<double>& turn_deg : {Vec3<double>(0, 0, 180), {0, 90, 0}, {120, -70, 30}, {180, 0, 0}}) {
        sim::StageParams params;
        params.position_sigma_m = 5e-5;
        params.noise_share = 1e-4;
        params.source_turn =
            geometry::rotation_vector_to_quaternion<double>(turn_deg * (std::numbers::pi / 180)).toRotationMatrix();
        std::string files;
        for (int fixture = 0; fixture < 3; ++fixture) {
            const std::string name = "soOther" + sim::ilemt_name(fixture, "ot").substr(std::string("soYoutZup").size());
            write(name, sim::ilemt_text(*triads_, params, fixture));
            files += " " + path(name);
        }
        const auto refitted = tricoil("evaluate --json --refit-fixtures --calibration " + path("r.toml") + files);
        ASSERT_EQ(refitted.exit_code, 0) << refitted.err;
        EXPECT_LT(number(refitted, "position_rms_m"), 3 * known) << eigen(turn_deg).transpose();
        EXPECT_LT(number(refitted, "orientation_rms_deg"), 0.1) << eigen(turn_deg).transpose();
    }
}

TEST_F(Stage, WritesResidualsAndAPicture) {
    ASSERT_EQ(tricoil("calibrate stage --out " + path("p.toml") + set("md")).exit_code, 0);
    const auto test = tricoil("evaluate --calibration " + path("p.toml") + " --out " + path("pictures") + set("ld"));
    ASSERT_EQ(test.exit_code, 0) << test.err;
    const std::string csv = read_file(path("pictures") + "/pose_errors.csv");
    EXPECT_EQ(std::count(csv.begin(), csv.end(), '\n'), 1 + 3 * 3 * 64);
    EXPECT_THAT(read_file(path("pictures") + "/error_vectors.svg"), HasSubstr("<svg"));
    ASSERT_EQ(tricoil("evaluate --csv-only --calibration " + path("p.toml") + " --out " + path("pictures") + set("ld")).exit_code,
              0);
    EXPECT_FALSE(std::filesystem::exists(path("pictures") + "/error_vectors.svg")) << "a picture of older errors";
}

/// Errors of 0.3 % make 0.15 mm at the border of the workspace. The stage's scale and its rotation about z are not observable.
TEST_F(Stage, ErrorsOfTheStageAreSeparatedFromTheTracker) {
    sim::StageParams params;
    params.position_sigma_m = 2e-5;
    params.noise_share = 1e-4;
    params.turns_deg = {-90, -30, 0, 90};
    params.turning << -1e-3, 0, 3e-3, 0, 2e-3, -2e-3, 1e-3, 0, -1e-3;
    for (int fixture = 0; fixture < 3; ++fixture) {
        write(sim::ilemt_name(fixture, "sag"), sim::ilemt_text(*triads_, params, fixture));
    }
    const std::string calibrate = "calibrate stage --json --model finite --out ";
    const auto ideal = tricoil(calibrate + path("ideal.toml") + set("sag"));
    const auto fit = tricoil(calibrate + path("sag.toml") + " --blob " + path("sag.bin") + " --stage turning" + set("sag"));
    ASSERT_EQ(fit.exit_code, 0) << fit.err;
    for (int row = 0; row < 3; ++row) {
        for (int column = 0; column < 3; ++column) {
            EXPECT_NEAR(fit.json()["stage_errors"]["turning"][row][column].get<double>(), params.turning(row, column), 3e-4)
                << row << column;
        }
    }
    EXPECT_LT(number(fit, "position_rms_m"), 0.6 * number(ideal, "position_rms_m"));
    // The estimated errors of the stage improve an evaluation with another calibration on the same stage.
    const auto given =
        tricoil("evaluate --json --stage-from " + path("sag.toml") + " --calibration " + path("ideal.toml") + set("sag"));
    EXPECT_THAT(given.json()["stage_errors"].get<std::string>(), HasSubstr("sag.toml"));
    const auto not_given = tricoil("evaluate --json --calibration " + path("ideal.toml") + set("sag"));
    EXPECT_LT(number(given, "position_rms_m"), 0.8 * number(not_given, "position_rms_m"));
    // They are not part of the blob.
    ASSERT_EQ(tricoil(calibrate + path("none.toml") + " --blob " + path("none.bin") + set("sag")).exit_code, 0);
    EXPECT_EQ(fs::file_size(path("sag.bin")), fs::file_size(path("none.bin")));
}

TEST_F(Stage, TheStageModelCostsNothingOnAnIdealStage) {
    for (const char* stage : {"ideal", "turning", "room"}) {
        const auto fit = tricoil(std::string("calibrate stage --json --model finite --stage ") + stage + " --out " +
                                 path("t.toml") + set("md"));
        ASSERT_EQ(fit.exit_code, 0) << fit.err;
        const auto test = tricoil("evaluate --json --calibration " + path("t.toml") + set("ld"));
        std::cout << stage << ": " << 1e3 * number(test, "position_rms_m") << " mm\n";
        EXPECT_LT(number(test, "position_rms_m"), 1.5e-4) << stage;
    }
}

TEST_F(Stage, WrongErrorsOfTheStageAreRefused) {
    ASSERT_EQ(tricoil("calibrate stage --out " + path("i.toml") + set("md")).exit_code, 0);
    const std::string evaluate = "evaluate --calibration " + path("i.toml") + set("ld");
    expect_refused(tricoil(evaluate + " --stage-from " + path("i.toml")), "has no errors of the stage");
    expect_refused(tricoil(evaluate + " --stage-from " + path("nothing.toml")), "nothing.toml");
    expect_refused(tricoil("calibrate stage --stage tuning --out " + path("x.toml") + set("md")), "did you mean 'turning'");
    std::string text = read_file(path("i.toml"));
    text.replace(text.find("turns_left_handed"), 0, "turning = [[30, 0, 0], [0, 30, 0], [0, 0, 30]]\n");  // in millimetres
    write("mm.toml", text);
    expect_refused(tricoil(evaluate + " --stage-from " + path("mm.toml")), "stage.turning");
}

TEST_F(Stage, BadLinesAreExcludedAndNamed) {
    auto lines = lines_of(sim::ilemt_name(1, "md"));
    std::swap(lines[10], lines[70]);  // no error: the order does not matter
    const auto tab = lines[40].find('\t');
    lines[40] = "12.00000" + lines[40].substr(tab);  // a wrong stage position
    write("soYoutZup_seZinXdown_bad.dat", joined(lines));
    const auto fit = tricoil("calibrate stage --json --out " + path("b.toml") + " " + path(sim::ilemt_name(0, "md")) + " " +
                             path("soYoutZup_seZinXdown_bad.dat") + " " + path(sim::ilemt_name(2, "md")));
    ASSERT_EQ(fit.exit_code, 0) << fit.err;
    ASSERT_EQ(fit.json()["outliers"].size(), 1U) << fit.out;
    EXPECT_THAT(fit.json()["outliers"][0].get<std::string>(), HasSubstr("bad.dat:41"));
    const auto test = tricoil("evaluate --json --calibration " + path("b.toml") + set("ld"));
    EXPECT_LT(number(test, "position_rms_m"), 6e-4);
}

TEST_F(Stage, GarbledInputNamesFileAndLine) {
    auto lines = lines_of(sim::ilemt_name(0, "md"));
    auto cut = lines;
    cut[7] = cut[7].substr(0, cut[7].size() / 2);
    write("cut.dat", joined(cut));
    expect_refused(tricoil("calibrate stage --out " + path("x.toml") + " " + path("cut.dat")), "cut.dat:8: ");
    auto garbled = lines;
    garbled[3].replace(garbled[3].find("i\t"), 1, "?");
    write("garbled.dat", joined(garbled));
    expect_refused(tricoil("calibrate stage --out " + path("x.toml") + " " + path("garbled.dat")), "garbled.dat:4: ");
    expect_refused(tricoil("calibrate stage --out " + path("x.toml") + " " + path("missing.dat")), "cannot be opened");
    write("few.dat", joined({lines.begin(), lines.begin() + 10}));
    expect_refused(tricoil("calibrate stage --out " + path("x.toml") + " " + path("few.dat")),
                   "10 poses are too few to calibrate; at least 30 are needed");
    write("few.dat", joined({lines.begin(), lines.begin() + 29}));
    expect_refused(tricoil("calibrate stage --out " + path("x.toml") + " " + path("few.dat")),
                   "29 poses are too few to calibrate; at least 30 are needed");
    EXPECT_FALSE(fs::exists(path("x.toml")));
}

TEST_F(Stage, DegeneratePosesAreRefused) {
    const auto lines = lines_of(sim::ilemt_name(0, "md"));
    std::vector<std::string> plane;
    std::vector<std::string> one_turn;
    for (const std::string& line : lines) {
        if (line.find("\t0.00000\t0.00000\t0.00000\t", line.find('\t', line.find('\t') + 1) + 1) != std::string::npos) {
            one_turn.push_back(line);
        }
        const auto second = line.find('\t', line.find('\t') + 1);
        if (line.substr(second + 1).starts_with("0.00000") || line.substr(second + 1).starts_with("-0.00000")) {
            plane.push_back(line);
        }
    }
    write("plane.dat", joined(plane) + joined(plane));  // twice: 27 poses are too few
    expect_refused(tricoil("calibrate stage --out " + path("x.toml") + " " + path("plane.dat")), "plane");
    write("one_turn.dat", joined(one_turn) + joined(one_turn));
    expect_refused(tricoil("calibrate stage --out " + path("x.toml") + " " + path("one_turn.dat")), "does not rotate");
}

TEST_F(Stage, WrongNamesMixedSetsAndReversedCoilsAreReported) {
    const auto first = lines_of(sim::ilemt_name(0, "md"));
    const auto second = lines_of(sim::ilemt_name(1, "md"));
    // The file name states another fixture than the couplings show.
    write("soYoutZup_seZinYup_wrong.dat", joined(second));
    const std::string wrong = " " + path(sim::ilemt_name(0, "md")) + " " + path("soYoutZup_seZinYup_wrong.dat");
    const auto warned = tricoil("calibrate stage --json --out " + path("w.toml") + wrong);
    ASSERT_EQ(warned.exit_code, 0) << warned.err;
    EXPECT_THAT(warned.json()["warnings"].dump(), HasSubstr("ZinYup"));
    expect_refused(tricoil("calibrate stage --fixtures named --out " + path("x.toml") + wrong), "differs by");
    // One of the files is from another tracker.
    const auto other = sim::make_triads(0.045, 3, 0.02, 123);
    write("soYoutZup_seZinXdown_other.dat", sim::ilemt_text(other, {}, 1));
    expect_refused(tricoil("calibrate stage --out " + path("x.toml") + " " + path(sim::ilemt_name(0, "md")) + " " +
                           path("soYoutZup_seZinXdown_other.dat") + " " + path(sim::ilemt_name(2, "md"))),
                   "other");
    // One source coil reversed: all its couplings change their sign.
    auto reversed = *triads_;
    reversed.source[1].axis *= -1;
    write("soYoutZup_seYoutZup_reversed.dat", sim::ilemt_text(reversed, {}, 0));
    expect_refused(tricoil("calibrate stage --out " + path("x.toml") + " " + path("soYoutZup_seYoutZup_reversed.dat")),
                   "reversed");
    // An unknown fixture at evaluation.
    ASSERT_EQ(tricoil("calibrate stage --out " + path("k.toml") + set("md")).exit_code, 0);
    write("soYoutZup_seXupYin_ld.dat", joined(first));
    expect_refused(tricoil("evaluate --calibration " + path("k.toml") + " " + path("soYoutZup_seXupYin_ld.dat")), "XupYin");
    EXPECT_FALSE(fs::exists(path("x.toml")));
}

/// Exact dipoles far from each other at 0.15 to 0.25 m. `turn`: of the source with its stage, `reversed`: source coils.
class SeparateCoils {
public:
    [[nodiscard]] std::string text(const Vec3<double>& turn_deg, const Vec3<double>& reversed = Vec3<double>::Ones(),
                                   bool transposed = false, double gain = 1) const {
        std::mt19937_64 random(5);
        std::normal_distribution<double> normal(0, 1);
        const Mat3<double> turn =
            geometry::rotation_vector_to_quaternion<double>(turn_deg * (std::numbers::pi / 180)).toRotationMatrix();
        std::string text;
        for (int n = 0; n < 135; ++n) {
            const Vec3<double> t = 0.05 * (Vec3<double>(n % 3, n / 3 % 3, n / 9 % 3) - Vec3<double>::Ones());
            const double turn_rad = (n / 27 - 2) * std::numbers::pi / 4;
            const Mat3<double> stage = geometry::rotation_z<double>(turn_rad).transpose();
            const Mat3<double> o = (turn * stage).transpose();
            Mat3<double> x = field::signal_matrix<double>(model_, turn * (Vec3<double>(0.01, 0.02, 0.2) + t), o);
            x.col(2) *= gain;
            x = x * reversed.asDiagonal();
            const double sigma = 1e-4 * x.cwiseAbs().maxCoeff();
            text += fmt::format("{:.3f}\t{:.3f}\t{:.3f}\t0\t0\t{:.1f}", 1e3 * t.x(), 1e3 * t.y(), 1e3 * t.z(),
                                turn_rad * 180 / std::numbers::pi);
            for (Index k = 0; k < 9; ++k) {
                const double value = (transposed ? x(k % 3, k / 3) : x(k / 3, k % 3)) + sigma * normal(random);
                text += fmt::format("\t{:+.12f}+0.000000000000i", value);
            }
            text += "\n";
        }
        return text;
    }

private:
    static field::GeneralDipole<double> model() {
        field::GeneralDipole<double> model;
        model.source_moment *= 1.2e-3;
        for (int j = 0; j < 3; ++j) {
            model.source_offset_m.col(j) = 0.045 * (Vec3<double>::Unit(j) - Vec3<double>::Constant(1.0 / 3));
        }
        return model;
    }
    field::GeneralDipole<double> model_ = model();
};

const std::array<std::pair<const char*, Vec3<double>>, 4> kMountings{
    {{"A", {0, 0, 0}}, {"B", {0, 0, 90}}, {"C", {90, 20, 0}}, {"D", {-50, 60, 120}}}};

TEST_F(Stage, MountingsOfSeparateCoilsAreCalibratedAloneAndTogether) {
    std::string files;
    for (const auto& [name, turn_deg] : kMountings) {
        const std::string file = std::string("so") + name + "_seB_md.dat";
        write(file, SeparateCoils().text(turn_deg, name == std::string("B") ? Vec3<double>(-1, -1, 1) : Vec3<double>::Ones()));
        files += " " + path(file);
        const auto alone = tricoil("calibrate stage --json --out " + path("alone.toml") + " " + path(file));
        ASSERT_EQ(alone.exit_code, 0) << alone.err;
        EXPECT_LT(number(alone, "position_rms_m"), 2e-4) << name;
    }
    const auto fit = tricoil("calibrate stage --json --out " + path("all.toml") + files);
    ASSERT_EQ(fit.exit_code, 0) << fit.err;
    EXPECT_LT(number(fit, "position_rms_m"), 2e-4);
    EXPECT_LT(number(fit, "residual_rms"), 4e-4);
    EXPECT_THAT(fit.json()["warnings"].dump(), HasSubstr("soB_seB_md.dat: source coil 1 reversed, source coil 2 reversed"));
    // The evaluation says so too.
    const auto test = tricoil("evaluate --json --calibration " + path("all.toml") + " " + path("soB_seB_md.dat"));
    EXPECT_LT(number(test, "position_rms_m"), 2e-4);
    EXPECT_THAT(test.err, HasSubstr("source coil 1 reversed"));
}

TEST_F(Stage, AMountingThatDoesNotBelongIsNamedAndLeftOut) {
    std::string files;
    for (const auto& [name, turn_deg] : kMountings) {
        const std::string file = std::string("so") + name + "_seC_md.dat";
        write(file, SeparateCoils().text(turn_deg, Vec3<double>::Ones(), false, name == std::string("C") ? 1.02 : 1));
        files += " " + path(file);
    }
    const auto fit = tricoil("calibrate stage --json --out " + path("left.toml") + files);
    ASSERT_EQ(fit.exit_code, 0) << fit.err;
    EXPECT_THAT(fit.json()["warnings"].dump(), HasSubstr("soC_seC_md.dat: left out"));
    EXPECT_LT(fit.json()["residual_rms_by_file"][path("soA_seC_md.dat")].get<double>(), 4e-4);
    EXPECT_EQ(number(fit, "poses"), 3 * 135);
    EXPECT_LT(number(fit, "position_rms_m"), 2e-4);
}

TEST_F(Stage, TransposedTablesZeroLinesAndOtherNamesAreRead) {
    const std::string zeros = fmt::format("0\t0\t0\t0\t0\t0\t{}\n", fmt::join(std::vector<std::string>(9, "+0.0+0.0i"), "\t"));
    write("run 7.dat", zeros + SeparateCoils().text({0, 0, 0}, Vec3<double>::Ones(), true));
    const auto fit = tricoil("calibrate stage --json --out " + path("t.toml") + " --fixture '" + path("run 7.dat") +
                             "=soLeft_seTop' '" + path("run 7.dat") + "'");
    ASSERT_EQ(fit.exit_code, 0) << fit.err;
    EXPECT_EQ(number(fit, "poses"), 135);
    EXPECT_LT(number(fit, "position_rms_m"), 2e-4);
    EXPECT_THAT(fit.json()["warnings"].dump(), HasSubstr("couplings transposed"));
    EXPECT_THAT(fit.err, HasSubstr("1 lines have only zero couplings"));
    EXPECT_THAT(read_file(path("t.toml")), HasSubstr("[source_stage.\"Left\"]"));
    expect_refused(tricoil("calibrate stage --out " + path("x.toml") + " --fixture other.dat=soA_seB " + set("md")),
                   "other.dat=soA_seB");
}

TEST_F(Stage, CouplingsOfOtherPosesDoNotChangeTheCalibration) {
    write("soA_seB_clean.dat", SeparateCoils().text({0, 0, 0}));
    const auto lines = lines_of("soA_seB_clean.dat");
    const std::string evaluate = "evaluate --json --calibration " + path("mixed.toml") + " " + path("soA_seB_clean.dat");
    ASSERT_EQ(tricoil("calibrate stage --out " + path("mixed.toml") + " " + path("soA_seB_clean.dat")).exit_code, 0);
    const double clean_m = number(tricoil(evaluate), "position_rms_m");
    for (const std::size_t every : {8U, 5U}) {
        auto mixed = lines;
        for (std::size_t n = 3; n < lines.size(); n += every) {
            const auto couplings = [&](std::size_t line) { return lines[line].find("\t", lines[line].find("\t0\t0\t") + 5); };
            const std::size_t other = (n + 71) % lines.size();
            mixed[n] = lines[n].substr(0, couplings(n)) + lines[other].substr(couplings(other));
        }
        write("soA_seB_mixed.dat", joined(mixed));
        const auto fit = tricoil("calibrate stage --json --out " + path("mixed.toml") + " " + path("soA_seB_mixed.dat"));
        ASSERT_EQ(fit.exit_code, 0) << fit.err;
        EXPECT_EQ(fit.json()["outliers"].size(), (lines.size() - 3 + every - 1) / every);
        EXPECT_LT(number(tricoil(evaluate), "position_rms_m"), 1.2 * clean_m) << every;
    }
}

TEST_F(Stage, APoseWithoutInPhaseCouplingsIsRefused) {
    std::string row = "0\t0\t0\t0\t0\t0";
    for (int k = 0; k < 9; ++k) {
        row += k % 4 == 0 ? "\t+0.0+0.1i" : "\t+0.0+0.0i";
    }
    write("soA_seB_zero.dat", SeparateCoils().text({0, 0, 0}) + row + "\n");
    expect_refused(tricoil("calibrate stage --out " + path("x.toml") + " " + path("soA_seB_zero.dat")),
                   "soA_seB_zero.dat:136: all in-phase couplings are zero");
}

TEST_F(Stage, TransposedTablesGiveThePhasesOfTheChannels) {
    for (const bool transposed : {false, true}) {
        write("soA_seB_phase.dat", SeparateCoils().text({0, 0, 0}, Vec3<double>::Ones(), transposed));
        std::string text;
        for (const std::string& line : lines_of("soA_seB_phase.dat")) {
            std::istringstream cells(line);
            std::string cell;
            for (int k = -6; std::getline(cells, cell, '\t'); ++k) {
                const double phase_rad = 0.01 * (1 + (transposed ? k % 3 : k / 3));
                const double x = std::stod(cell);
                text += (k > -6 ? "\t" : "") +
                        (k < 0 ? cell : fmt::format("{:+.12f}{:+.12f}i", x * std::cos(phase_rad), x * std::sin(phase_rad)));
            }
            text += "\n";
        }
        write("soA_seB_phase.dat", text);
        const auto fit =
            tricoil("calibrate stage --out " + path("p.toml") + " --blob " + path("p.bin") + " " + path("soA_seB_phase.dat"));
        ASSERT_EQ(fit.exit_code, 0) << fit.err;
        const auto bytes = read_file(path("p.bin"));
        const auto read = calibration::decode({reinterpret_cast<const std::uint8_t*>(bytes.data()), bytes.size()});
        ASSERT_TRUE(read.ok()) << read.status().message();
        for (int i = 0; i < 3; ++i) {
            EXPECT_NEAR(read->phase_rad(i, 0), 0.01 * (1 + i), 1e-4) << transposed;
        }
    }
}

TEST_F(Stage, FilesOfFewPosesNeedTheNameOfTheirFixture) {
    write("soA_seB_all.dat", SeparateCoils().text({0, 0, 0}));
    const auto lines = lines_of("soA_seB_all.dat");
    std::string same;
    std::string unnamed;
    for (std::size_t part = 0; part < 6; ++part) {
        std::string text;
        for (std::size_t n = part; n < lines.size(); n += 15) {
            text += lines[n] + "\n";
        }
        write(fmt::format("soA_seB_part{}.dat", part), text);
        write(fmt::format("part{}.dat", part), text);
        same += " " + path(fmt::format("soA_seB_part{}.dat", part));
        unnamed += " " + path(fmt::format("part{}.dat", part));
    }
    const auto fit = tricoil("calibrate stage --json --out " + path("parts.toml") + same);
    ASSERT_EQ(fit.exit_code, 0) << fit.err;
    EXPECT_LT(number(fit, "position_rms_m"), 2e-4);
    expect_refused(tricoil("calibrate stage --out " + path("x.toml") + unnamed),
                   "sensor fixture 'part0' has 9 poses; 12 are needed");
}

TEST_F(Stage, FixturesOfOtherCoilsAreRefused) {
    ASSERT_EQ(tricoil("calibrate stage --out " + path("o.toml") + set("md")).exit_code, 0);
    write("soZ_seZ_other.dat", SeparateCoils().text({0, 0, 0}));
    expect_refused(tricoil("evaluate --refit-fixtures --calibration " + path("o.toml") + " " + path("soZ_seZ_other.dat")),
                   "--refit-fixtures: found no fixtures");
}

TEST_F(Stage, FreeMotionTakesTheModelThatExplainsTheCouplings) {
    const std::string free_motion = "calibrate free-motion --json --out " + path("free.toml") + set("md");
    const auto richer = tricoil(free_motion);
    ASSERT_EQ(richer.exit_code, 0) << richer.err;
    EXPECT_THAT(richer.json()["warnings"].dump(), HasSubstr("took --model general"));
    EXPECT_LT(number(richer, "residual_rms"), 0.01);
    fs::remove(path("free.toml"));
    expect_refused(tricoil(free_motion + " --model concentric"), "no more than 1 % is a calibration");
    EXPECT_FALSE(fs::exists(path("free.toml")));
}

TEST_F(Stage, AnExistingCalibrationSurvivesAFailure) {
    ASSERT_EQ(tricoil("calibrate stage --out " + path("keep.toml") + set("md")).exit_code, 0);
    const std::string before = read_file(path("keep.toml"));
    expect_refused(tricoil("calibrate stage --out " + path("keep.toml") + " " + path(sim::ilemt_name(0, "md")) + " /dev/null"),
                   "");
    EXPECT_EQ(read_file(path("keep.toml")), before);
    // A damaged calibration is refused; the message names the file.
    std::string damaged = before;
    damaged.replace(damaged.find("sensitivity"), 11, "sensitiveness");
    write("damaged.toml", damaged);
    expect_refused(tricoil("evaluate --calibration " + path("damaged.toml") + set("ld")), "damaged.toml");
    write("half.toml", before.substr(0, before.size() / 2));
    expect_refused(tricoil("evaluate --calibration " + path("half.toml") + set("ld")), "half.toml");
}

}  // namespace
}  // namespace tricoil::test
