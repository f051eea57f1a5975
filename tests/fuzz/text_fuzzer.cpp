// Random lines as columns and couplings of other hardware. The first line is the name of the source.
#include "board/linux/text_name.hpp"
#include "board/linux/text_rows.hpp"
#include "board/support/text_table.hpp"
#include "tests/fuzz/input_file.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {  // NOLINT(readability-identifier-naming)
    using namespace tricoil;
    const std::string_view text = fuzz::text_of(data, size);
    const auto lines = host::split(text, '\n');
    fuzz::accept_or_refuse([&] { (void)linux_board::parse_text_name("columns:" + std::string(lines.front())); });
    linux_board::TextRows rows;
    for (const std::string_view line : lines) {
        fuzz::accept_or_refuse([&] { (void)rows.parse(line); });
    }
    return 0;
}
