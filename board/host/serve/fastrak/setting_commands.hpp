// Arguments of FASTRAK commands, and the commands that only read or change settings.
#pragma once

#include <cmath>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "board/host/serve/fastrak/records.hpp"
#include "board/support/text_table.hpp"

namespace tricoil::host::fastrak {

/// Thrown for an invalid argument; the session answers with the error record.
struct Refusal {
    CommandError error;
    std::size_t position = 0;
    std::size_t field = 0;
    int station = 1;
};

/// Comma-separated arguments of a command.
class Arguments {
public:
    /// command: its letter and the arguments, without line end. Must outlive this object.
    explicit Arguments(std::string_view command)
        : is_of_station_(kOfStations.find(command.front()) != std::string_view::npos), text_(command.substr(1)) {
        for (std::size_t begin = 1;;) {
            const std::size_t end = std::min(command.find(',', begin), command.size());
            fields_.push_back({begin, trim(command.substr(begin, end - begin))});
            if (end == command.size()) {
                break;
            }
            begin = end + 1;
        }
    }

    /// All arguments, with their commas and blanks.
    [[nodiscard]] std::string_view text() const { return text_; }

    /// The n-th field, counted from 0; empty if omitted.
    [[nodiscard]] std::string_view text(std::size_t n) const { return n < fields_.size() ? fields_[n].text : std::string_view(); }

    /// Number of fields from the n-th on, counted from 0, without trailing empty fields.
    [[nodiscard]] std::size_t count_from(std::size_t n) const {
        std::size_t count = fields_.size();
        while (count > n && fields_[count - 1].text.empty()) {
            --count;
        }
        return count > n ? count - n : 0;
    }

    /// Station in the first field.
    [[nodiscard]] int station() const {
        const double number = needed_number(0);
        if (number < 1 || number > kStations || number != std::floor(number)) {
            refuse(0, CommandError::out_of_range);
        }
        return static_cast<int>(number);
    }

    /// The n-th field, counted from 0; empty if omitted.
    [[nodiscard]] std::optional<double> number(std::size_t n) const {
        std::string_view text = this->text(n);
        if (text.empty()) {
            return std::nullopt;
        }
        text.remove_prefix(text.front() == '+' ? 1 : 0);
        const auto value = number_from<double>(text);
        if (!value || !std::isfinite(*value)) {
            refuse(n, CommandError::not_numeric);
        }
        return value;
    }

    /// The n-th field, which must be given.
    [[nodiscard]] double needed_number(std::size_t n) const {
        const std::optional<double> value = number(n);
        if (!value) {
            refuse(n, CommandError::field_missing);
        }
        return *value;
    }

    /// The n-th field, at most `limit` in magnitude, or `otherwise` if omitted.
    [[nodiscard]] double number(std::size_t n, double otherwise, double limit) const {
        const double value = number(n).value_or(otherwise);
        if (std::abs(value) > limit) {
            refuse(n, CommandError::out_of_range);
        }
        return value;
    }

    [[nodiscard]] Vec3<double> vector(std::size_t n, const Vec3<double>& otherwise, double limit) const {
        return {number(n, otherwise.x(), limit), number(n + 1, otherwise.y(), limit), number(n + 2, otherwise.z(), limit)};
    }

    [[noreturn]] void refuse(std::size_t n, CommandError error) const {
        throw Refusal{error, n < fields_.size() ? fields_[n].position : 0, n, named_station()};
    }

private:
    static constexpr std::string_view kOfStations = "OHBbGARNlIQVre";  // commands whose first field is a station

    struct Field {
        std::size_t position;
        std::string_view text;
    };
    static std::string_view trim(std::string_view text) {
        const std::size_t begin = std::min(text.find_first_not_of(' '), text.size());
        return text.substr(begin, text.find_last_not_of(' ') + 1 - begin);
    }

    /// Station of the command; 1 if it names none.
    [[nodiscard]] int named_station() const {
        const std::string_view text = fields_.front().text;
        const bool is_one = is_of_station_ && text.size() == 1 && text.front() >= '1' && text.front() < '1' + kStations;
        return is_one ? text.front() - '0' : 1;
    }

    bool is_of_station_;
    std::string_view text_;
    std::vector<Field> fields_;
};

/// Letters of the commands that execute_setting() executes.
constexpr std::string_view kSettingCommands = "OGARNIQVrexvXyo";

/// Executes the command with this letter. Returns the record to send; empty: none. Throws Refusal, with unchanged settings, for
/// missing or invalid arguments.
std::string execute_setting(Settings& settings, char letter, const Arguments& arguments);

}  // namespace tricoil::host::fastrak
