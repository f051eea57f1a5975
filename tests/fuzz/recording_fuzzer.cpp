// Random text as the files of a recording that was not completed: description, inputs, poses.
#include "board/record/recording.hpp"
#include "tests/fuzz/input_file.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {  // NOLINT(readability-identifier-naming)
    using namespace tricoil;
    static const fuzz::InputFolder folder;
    std::string_view rest = fuzz::text_of(data, size);
    (void)folder.write("recording.json", fuzz::take_part(rest));
    (void)folder.write("inputs.csv", fuzz::take_part(rest));
    (void)folder.write("poses.csv", fuzz::take_part(rest));
    fuzz::accept_or_refuse([] { (void)host::Recording(folder.path()); });
    std::string line;
    fuzz::accept_or_refuse([&] {
        host::RecordLines inputs(folder.path(), host::RecordFile::inputs);
        while (inputs.next(line)) {  // a line that is written and read again stays the same
            const auto input = host::parse_input(line, "inputs");
            const std::string again = host::line_of(input);
            if (host::line_of(host::parse_input(again.substr(0, again.find('\n')), "again")) != again) {
                std::abort();
            }
        }
    });
    fuzz::accept_or_refuse([&] {
        host::RecordLines poses(folder.path(), host::RecordFile::poses);
        while (poses.next(line)) {
            (void)host::parse_pose(line, "poses");
        }
    });
    return 0;
}
