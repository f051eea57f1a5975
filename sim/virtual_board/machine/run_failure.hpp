// End of a run: the firmware caused a hardware fault or used something outside this model.
#pragma once

#include <fmt/format.h>

#include <stdexcept>
#include <string>

namespace tricoil::virtual_board {

/// Peripherals throw it without the pc. The processor adds the pc; the program adds the function name.
class RunFailure : public std::runtime_error {
public:
    using std::runtime_error::runtime_error;
};

/// A use that this model cannot follow as the chip does. Thrown last, after the access had its effect; with --as-chip the run
/// goes on.
struct Doubt : RunFailure {
    using RunFailure::RunFailure;
};
inline void doubt_if(bool is_doubtful, const std::string& reason) {
    if (is_doubtful) {
        throw Doubt(reason);
    }
}

inline void fail_if(bool is_wrong, const char* reason) {
    if (is_wrong) {
        throw RunFailure(reason);
    }
}
template <typename... Values>
void fail_if(bool is_wrong, fmt::format_string<const Values&...> reason, const Values&... values) {
    fail_if(is_wrong, is_wrong ? fmt::format(reason, values...).c_str() : "");
}

}  // namespace tricoil::virtual_board
