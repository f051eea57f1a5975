// `tricoil plot`: pictures of recordings and CSV files; bad input.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/cli/cli_runner.hpp"

namespace tricoil::test {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;
using ::testing::Not;

class Plot : public ::testing::Test {
protected:
    static void SetUpTestSuite() {
        fs::remove_all(kTake);
        const auto r = tricoil("run --duration 3 --fault unplugged@1-2 --confined --record " + kTake + " --out " + kCsv);
        ASSERT_EQ(r.exit_code, 0) << r.err;
    }
    static void expect_plot_refused(const std::string& arguments, const std::string& what) {
        const auto r = tricoil("plot " + arguments);
        EXPECT_EQ(r.exit_code, 2) << r.out << r.err;
        EXPECT_THAT(r.err, HasSubstr(what));
        EXPECT_EQ(std::count(r.err.begin(), r.err.end(), '\n'), 1) << r.err;
    }
    static std::string svg_of(const std::string& poses) {
        const auto r = tricoil("plot " + poses + " --out -");
        EXPECT_EQ(r.exit_code, 0) << r.err;
        EXPECT_TRUE(r.out.starts_with("<?xml")) << r.out.substr(0, 50);
        EXPECT_TRUE(r.out.ends_with("</svg>\n")) << r.out.substr(r.out.size() - 20);
        return r.out;
    }
    static inline const std::string kTake = path_in_temp("plotted");
    static inline const std::string kCsv = path_in_temp("plotted.csv");
};

TEST_F(Plot, ARecordingShowsPathDeviationAndFlags) {
    const std::string svg = svg_of(kTake);
    for (const char* text :
         {"Path from above", "Path from the side", "Standard deviation of the position", "no_sensor", "y (m)"}) {
        EXPECT_THAT(svg, HasSubstr(text));
    }
    EXPECT_THAT(svg, Not(HasSubstr("Position error")));
    EXPECT_THAT(svg, Not(HasSubstr("saturated"))) << "flags that are never set have no line";
}

TEST_F(Plot, ACsvFileOfASimulationShowsErrorsToo) {
    EXPECT_THAT(svg_of(kCsv), HasSubstr("Position error and standard deviation"));
    const std::string plain = path_in_temp("plain.csv");
    ASSERT_EQ(tricoil("convert " + kTake + " --to csv --out " + plain).exit_code, 0);
    EXPECT_EQ(svg_of(plain), svg_of(kTake));
}

TEST_F(Plot, ATableHasTheUnitOfItsHeader) {
    for (const std::string unit : {"mm", "cm", "in"}) {
        const std::string table = path_in_temp("plotted_" + unit + ".csv");
        ASSERT_EQ(tricoil("convert " + kTake + " --to csv --units " + unit + " --out " + table).exit_code, 0);
        const std::string svg = svg_of(table);
        EXPECT_THAT(svg, HasSubstr("y (" + unit + ")"));
        if (unit == "in") {  // the option goes to tricoil convert, as above
            EXPECT_EQ(svg, svg_of(kTake + " --units " + unit));
        }
    }
}

/// The drawing program reads the user's file itself: no file as large as that is written.
TEST_F(Plot, ATableIsNotCopied) {
    std::string text = "time_s,x_m,y_m,z_m,note\n";
    for (int n = 0; n < 1000; ++n) {
        text += std::to_string(n) + ",0,0,0," + std::string(1000, 'n') + "\n";
    }
    const auto r = tricoil("plot " + write_file("long.csv", text) + " --out -", "ulimit -f 800");
    EXPECT_EQ(r.exit_code, 0) << r.err;
    EXPECT_TRUE(r.out.ends_with("</svg>\n"));
}

/// A curve is interrupted where there are no valid poses: the sensor was unplugged for a second.
TEST_F(Plot, InvalidPosesAreNotDrawn) {
    const std::string whole = path_in_temp("whole.csv");
    ASSERT_EQ(tricoil("run --duration 3 --out " + whole).exit_code, 0);
    const auto moves = [](const std::string& svg) {
        const std::size_t path = svg.find("<g id=\"path1_0\">");
        const std::string curve = svg.substr(path, svg.find("</g>", path) - path);
        return std::count(curve.begin(), curve.end(), 'M');
    };
    EXPECT_GT(moves(svg_of(kCsv)), moves(svg_of(whole)));
}

TEST_F(Plot, WritesPngAndNamesTheFile) {
    const std::string png = path_in_temp("poses.png");
    const auto r = tricoil("plot --json " + kTake + " --out " + png);
    ASSERT_EQ(r.exit_code, 0) << r.err;
    EXPECT_EQ(r.json()["out"], png);
    EXPECT_EQ(r.json()["poses"].get<int>() > 500, true);
    EXPECT_TRUE(read_file(png).starts_with("\x89PNG"));
    const auto beside = tricoil("plot " + kTake + "/", "cd " + fs::path(kTake).parent_path().string());
    EXPECT_THAT(beside.out, HasSubstr("plotted.svg: "));
    EXPECT_TRUE(fs::remove(kTake + ".svg"));
}

/// As for every command: a byte-order mark, comments, semicolons and decimal commas.
TEST_F(Plot, ATableOfASpreadsheetIsDrawn) {
    const std::string plain = write_file("plain_table.csv", "time_s,valid,x_m,y_m,z_m\n1,1,0.5,0,0\n2,0,,,\n3,1,0.25,0.1,0\n");
    const std::string other = write_file(
        "other.csv", "\xEF\xBB\xBF# session 3\nz_m;y_m;x_m;valid;time_s\n\n0;0;0,5;1;1\n;;;0;2\n0;0,1;0,25;1;3\n;;;;\n");
    EXPECT_EQ(svg_of(other), svg_of(plain));
}

TEST_F(Plot, OnePoseWithoutFlagsIsAPicture) {
    const std::string path = write_file("one.csv", "time_s,x_m,y_m,z_m\n1,0,0,0\n2,0.1,0,0\n");
    EXPECT_THAT(svg_of(path), HasSubstr("none"));
}

TEST_F(Plot, BadInputIsNamed) {
    const auto refuse = [](const std::string& text, const std::string& what) {
        const std::string path = write_file("bad.csv", text);
        const std::string out = path_in_temp("bad.svg");
        expect_plot_refused(path + " --out " + out, path + what);
        EXPECT_FALSE(fs::exists(out));
    };
    refuse("time_s,x_ft,y_ft,z_ft\n0,1,2,3\n",
           ":1: no column x_m; the header must have time_s or time_us, x_m, y_m and z_m, or mm, cm or in instead");
    refuse("time_s,x_mm,y_m,z_m\n0,1,2,3\n", ":1: no column y_mm; the header must have");
    refuse("x_m,y_m,z_m\n1,2,3\n", ":1: no column time_s; the header must have");
    refuse("time_s,x_m,y_m,z_m\n0,1,2\n", ":2: 3 columns; 4 are needed, as in line 1");
    refuse("time_s,x_m,y_m,z_m\n0,1,2,x\n", ":2: z_m: 'x' is not a number");
    refuse("time_s,x_m,y_m,z_m\n0,1,2,\n", ":2: z_m is missing");
    refuse("time_s,x_m,y_m,z_m\n0,1,2,nan\n", ":2: z_m: nan is not finite; remove or repair the line");
    refuse("time_s,valid,x_m,y_m,z_m\n0,0,1,2,3\n", ": has no valid pose to draw");
    refuse("time_s,flags,x_m,y_m,z_m\n0,65535,1,2,3\n", ":2: 65535 has unknown flags");
    refuse("time_s,sensor,x_m,y_m,z_m\n0,9,1,2,3\n", ":2: sensor 9 must be 0 to 3");
    refuse("", ": is empty");
    expect_plot_refused(kCsv + " --out picture.pdf", "must end with .svg or .png");
    expect_plot_refused("/nowhere", "/nowhere: cannot be opened; check the path and its permissions");
}

}  // namespace
}  // namespace tricoil::test
