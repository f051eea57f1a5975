// Random JSON as control requests of the live page, one per line: each is refused, or answered by one line. Nothing but
// recordings with permitted names comes into the folder of recordings.
#include <filesystem>

#include "board/host/serve/web/page_output.cpp"  // NOLINT(bugprone-suspicious-include): the requests are local to this file
#include "tests/fuzz/input_file.hpp"

const std::string_view tricoil::host::web::kPage = "page";

namespace {

using namespace tricoil::host;  // NOLINT(google-build-using-namespace): a program of one file

void require(bool holds) {
    if (!holds) {
        std::abort();
    }
}

void check_answer(const std::string& answer) {
    require(answer.find_first_of("\r\n") == std::string::npos);
    require(web::answer(200, answer).starts_with("HTTP/1.1 200 "));
}

/// Checks and removes the recordings.
void check_folder(const std::string& folder) {
    for (const auto& entry : std::filesystem::directory_iterator(folder)) {
        require(is_recording_name(entry.path().filename().string()));
        std::filesystem::remove_all(entry.path());
    }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {  // NOLINT(readability-identifier-naming)
    static const tricoil::fuzz::InputFolder folder;
    const PoseHub hub;
    TrackerControl control;
    RecordingSwitch recordings(folder.path(), {{"kind", "fuzz"}, {"tour", {{{"name", "a"}}, {{"name", "b"}}}}});
    StylusButton button;
    web::Tour tour;
    web::ServedPage page{{}, {}, hub, control, recordings, button, &tour};
    std::string_view rest = tricoil::fuzz::text_of(data, size);
    while (!rest.empty()) {
        const std::size_t end = std::min(rest.find('\n'), rest.size());
        try {
            check_answer(web::execute_request(std::string(rest.substr(0, end)), page));
        } catch (const InputError& refusal) {
            require(std::string_view(refusal.what()).find(folder.path()) == std::string_view::npos);
            check_answer(refusal.what());
        }
        rest.remove_prefix(std::min(end + 1, rest.size()));
    }
    for (const auto& [sensor, towards] : control.take()) {
        require(sensor < tricoil::tracking::kMaxSensors && towards.allFinite());
    }
    require(tour.asked.load().step < 2);
    check_answer(recordings.record(false));
    check_folder(folder.path());
    return 0;
}
