// All readers of tables accept the same forms and refuse the same errors.
#include <fmt/ranges.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>
#include <functional>
#include <map>

#include "board/host/calibration/frame_file.hpp"
#include "board/host/calibration/pose_set.hpp"
#include "board/linux/text_rows.hpp"
#include "board/support/errors.hpp"
#include "board/support/sim_input/trajectory_file.hpp"
#include "tests/support/temporary_path.hpp"

namespace tricoil::host {
namespace {

using ::testing::HasSubstr;
using ::testing::StartsWith;
using Cells = std::vector<std::vector<std::string>>;

std::string write(const std::string& text) {
    std::string path = test::path_in_temp("table.csv");
    std::ofstream(path, std::ios::binary) << text;
    return path;
}

std::string joined(const Cells& rows, const std::string& separator) {
    std::string text;
    for (const auto& row : rows) {
        text += fmt::format("{}\n", fmt::join(row, separator));
    }
    return text;
}

std::string replaced(std::string text, const std::string& from, const std::string& to) {
    for (std::size_t at = text.find(from); at != std::string::npos; at = text.find(from, at + to.size())) {
        text.replace(at, from.size(), to);
    }
    return text;
}

std::string wide(const std::string& text, bool low_first) {
    std::string bytes = low_first ? "\xFF\xFE" : "\xFE\xFF";
    for (const char c : text) {
        bytes += low_first ? std::string{c, '\0'} : std::string{'\0', c};
    }
    return bytes;
}

template <typename... Matrices>
std::string text_of(const Matrices&... matrices) {
    std::string text;
    const auto add = [&](const auto& m) {
        for (Index k = 0; k < m.size(); ++k) {
            text += fmt::format("{} ", m(k % m.rows(), k / m.rows()));
        }
    };
    (add(matrices), ...);
    return text;
}

/// What a reader reads, as text.
struct Reader {
    std::string name;
    Cells table;  // with a line of names, unless it has none
    std::function<std::string(const std::string& path)> read;
    bool has_names = true;
};

std::vector<std::string> names(const std::string& list) {
    std::vector<std::string> result;
    for (const auto name : split(list, ',')) {
        result.emplace_back(name);
    }
    return result;
}

/// Rows below a header: `lead` gives the cells before the couplings.
Cells couplings(const std::string& before, const std::function<std::vector<std::string>(int)>& lead, int rows = 3) {
    Cells cells{names(before + "x11,x12,x13,x21,x22,x23,x31,x32,x33")};
    for (int n = 0; n < rows; ++n) {
        auto row = lead(n);
        for (int k = 0; k < 9; ++k) {
            row.push_back(fmt::format("{}", (k % 4 == 0 ? 0.5 : 0.01) + 0.001 * k + 0.0001 * n));
        }
        cells.push_back(row);
    }
    return cells;
}

std::string read_text_rows(const std::string& path) {
    linux_board::TextRows rows;
    LineReader lines(path);
    std::string text;
    for (std::string line; lines.next(line);) {
        try {
            if (const auto frame = rows.parse(line)) {
                text += fmt::format("{} ", *frame->time_us) + text_of(frame->in_phase[0], frame->in_phase[1], frame->in_phase[2]);
            }
        } catch (const InputError& error) {
            throw InputError(fmt::format("{}:{}: {}", path, lines.line(), error.what()));
        }
    }
    return text;
}

std::vector<Reader> readers() {
    Cells trajectory;
    for (int n = 0; n < 8; ++n) {
        trajectory.insert(trajectory.end(), {{"1", "0", "0", fmt::format("{}", 0.5 + n)},
                                             {"0", "1.0", "0", "0.25"},
                                             {"0", "0", "1", "0.125"},
                                             {"0", "0", "0", "1"}});
    }
    const auto frames = [](const std::string& path) {
        Table table(path);
        std::string text;
        for (const auto& frame : read_frames(table)) {
            text += text_of(frame.x);
        }
        return text;
    };
    const auto on_grid = [](const std::string& path) {
        std::string text;
        for (const auto& frame : read_grid(path)) {
            text += text_of(frame.x, frame.node);
        }
        return text;
    };
    const auto on_stage = [](const std::string& path) {
        std::string text;
        const PoseFile file = read_pose_file(path);
        for (const auto& pose : file.poses) {
            text += text_of(pose.x, pose.stage_position_m, pose.stage_rotation);
        }
        return text;
    };
    const auto motion = [](const std::string& path) {
        std::string text;
        for (const auto& pose : read_trajectory(path)) {
            text += text_of(pose.position_m);
        }
        return text;
    };
    const auto number = [](int n) { return fmt::format("{}", n); };
    return {
        {"frames", couplings("operator,", [](int) { return std::vector<std::string>{"A"}; }), frames},
        {"grid",
         couplings("column,row,level,",
                   [&](int n) {
                       return std::vector<std::string>{number(n), "0.0", "1"};
                   }),
         on_grid},
        {"stage",
         couplings("x_m,y_m,z_m,qw,qx,qy,qz,",
                   [&](int n) { return std::vector<std::string>{number(n), "0.5", "0", "0.6", "0.8", "0", "0"}; }),
         on_stage},
        {"trajectory", trajectory, motion, false},
        {"live couplings", couplings("time_us,", [&](int n) { return std::vector<std::string>{number(1000 * n)}; }),
         read_text_rows},
    };
}

Cells reversed(Cells table) {
    for (auto& row : table) {
        std::ranges::reverse(row);
    }
    return table;
}

Cells quoted(Cells table) {
    for (auto& row : table) {
        for (auto& cell : row) {
            cell = " \"" + cell + "\" ";
        }
    }
    return table;
}

/// The same table in all accepted forms.
std::map<std::string, std::string> forms_of(const Reader& reader) {
    const std::string plain = joined(reader.table, ",");
    const std::string empty_row = std::string(reader.table[0].size() - 1, ',') + "\n";
    const auto first_end = plain.find('\n') + 1;
    std::map<std::string, std::string> forms{
        {"byte-order mark", "\xEF\xBB\xBF" + plain},
        {"CRLF", replaced(plain, "\n", "\r\n")},
        {"no last line feed", plain.substr(0, plain.size() - 1)},
        {"blanks", replaced(plain, ",", " , ")},
        {"semicolons", joined(reader.table, ";")},
        {"tabs", joined(reader.table, "\t")},
        {"only blanks", joined(reader.table, "  ")},
        {"decimal comma, semicolons", replaced(joined(reader.table, "; "), ".", ",")},
        {"decimal comma, tabs", replaced(joined(reader.table, "\t"), ".", ",")},
        {"decimal comma, blanks", replaced(joined(reader.table, " "), ".", ",")},
        {"decimal comma in quotation marks", replaced(joined(quoted(reader.table), ","), ".", ",")},
        {"quotation marks", joined(quoted(reader.table), ",")},
        {"comments", "# operator A, 3 mm\n" + plain.substr(0, first_end) + "  # pause, again\n" + plain.substr(first_end)},
        {"blank lines", "\n \t\n" + plain.substr(0, first_end) + "\n" + plain.substr(first_end) + "\n\r\n"},
        {"empty rows", empty_row + plain + empty_row + empty_row},
    };
    if (reader.has_names) {
        forms["other order"] = joined(reversed(reader.table), ",");
        forms["empty cells at the end"] = replaced(plain, "\n", ",,\n");
    }
    if (reader.name != "live couplings") {  // from a stream, not from a spreadsheet
        forms["empty cell behind the first row"] = plain.substr(0, first_end - 1) + ",\n" + plain.substr(first_end);
        forms["UTF-16"] = wide(replaced(joined(reader.table, "\t"), "\n", "\r\n"), true);
        forms["UTF-16, high byte first"] = wide(plain, false);
    }
    return forms;
}

TEST(Tables, AreReadAlikeInAllForms) {
    for (const Reader& reader : readers()) {
        const std::string plain = reader.read(write(joined(reader.table, ",")));
        ASSERT_GT(plain.size(), 20U) << reader.name;
        for (const auto& [form, text] : forms_of(reader)) {
            try {
                EXPECT_EQ(reader.read(write(text)), plain) << reader.name << ": " << form;
            } catch (const std::exception& error) {
                ADD_FAILURE() << reader.name << ": " << form << ": " << error.what();
            }
        }
    }
}

TEST(Tables, OfAllKindsAreRefusedForTheSameErrors) {
    for (const Reader& reader : readers()) {
        const auto refused = [&](const Cells& table, const std::string& separator, const std::string& says) {
            const std::string path = write(joined(table, separator));
            try {
                (void)reader.read(path);
                ADD_FAILURE() << reader.name << ": not refused: " << says;
            } catch (const InputError& error) {
                EXPECT_THAT(error.what(), StartsWith(path)) << reader.name;
                EXPECT_THAT(error.what(), HasSubstr(says)) << reader.name;
                EXPECT_THAT(std::string(error.what()), ::testing::Not(HasSubstr("\n")));
            }
        };
        const bool is_live = reader.name == "live couplings";
        const std::string last = reader.has_names ? reader.table[0].back() : "column 4";
        const auto with = [&](const std::string& cell) {
            Cells table = reader.table;
            table[2].back() = cell;
            return table;
        };
        refused(with("abc"), ",", ":3: " + last);
        refused(with("abc"), ",", "'abc'");
        refused(with("1.2.3"), ",", "is not a number");
        refused(with("+-1"), ",", "is not a number");
        refused(with("1.234,5"), ";", "is not a number");
        refused(with("\"1\"2"), ",", "is not a number");
        refused(with("nan"), ",", is_live ? "finite" : "is not finite");
        Cells table = reader.table;
        table[2].pop_back();
        refused(table, ",",
                is_live ? "instead of" : fmt::format(":3: {} columns; {} are needed", table[2].size(), table[0].size()));
        if (reader.has_names && !is_live) {
            table = reader.table;
            table.erase(table.begin());
            refused(table, ",", reader.name == "stage" ? ":1: 16 cells" : ":1: has numbers; the header must have ");
            table = reader.table;
            table[0].back() = "other";
            refused(table, ",", ":1: no column " + last + "; the header must have ");
            table = reader.table;
            for (auto& row : table) {
                row.push_back(row.back());
            }
            refused(table, ",", ":1: more than one column " + last + "; the header must have ");
        }
    }
}

}  // namespace
}  // namespace tricoil::host
