#include "board/virtual_board/can_rate_text.hpp"

#include "board/support/errors.hpp"
#include "board/support/text_table.hpp"

namespace tricoil::virtual_board {
namespace {

constexpr unsigned kLowestHz = 10'000;  // ISO 11898: 1 Mbit/s in the arbitration phase, 8 Mbit/s in the data phase
constexpr unsigned kHighestNominalHz = 1'000'000;
constexpr unsigned kHighestDataHz = 8'000'000;

}  // namespace

CanWire::Rates parse_can_rate(const std::string& text) {
    const auto slash = text.find('/');
    const unsigned nominal = host::number_from<unsigned>(text.substr(0, slash)).value_or(0);
    const unsigned data = slash == std::string::npos ? nominal : host::number_from<unsigned>(text.substr(slash + 1)).value_or(0);
    if (nominal < kLowestHz || nominal > kHighestNominalHz || data < nominal || data > kHighestDataHz) {
        throw host::InputError(
            "--can-rate '" + text +
            "': give NOMINAL or NOMINAL/DATA in bit/s: NOMINAL 10000 to 1000000, DATA up to 8000000, for example "
            "500000/2000000");
    }
    return {static_cast<double>(nominal), static_cast<double>(data)};
}

}  // namespace tricoil::virtual_board
