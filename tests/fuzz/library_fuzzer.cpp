// Random text as a recording in the folder of the live page: its name, description, inputs, poses. It is listed and sent as JSON,
// or refused without the path of the folder.
#include <cstdlib>
#include <filesystem>

#include "board/host/serve/recording_switch.hpp"
#include "board/host/serve/web/recording_library.hpp"
#include "tests/fuzz/input_file.hpp"

namespace {

using namespace tricoil::host;  // NOLINT(google-build-using-namespace): a program of one file

void require(bool holds) {
    if (!holds) {
        std::abort();
    }
}

void check_sent(const Recording& recording) {
    std::string sent;
    web::send_poses(recording, [&](std::string_view piece) {
        sent += piece;
        return true;
    });
    std::string_view rest = sent;
    require(rest.ends_with('\n') && nlohmann::json::parse(rest.substr(0, rest.find('\n'))).contains("name"));
    while (!rest.empty()) {
        const std::size_t end = rest.find('\n');
        require(nlohmann::json::accept(rest.substr(0, end)));
        rest.remove_prefix(end + 1);
    }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {  // NOLINT(readability-identifier-naming)
    static const tricoil::fuzz::InputFolder folder;
    std::string_view rest = tricoil::fuzz::text_of(data, size);
    const std::string asked(tricoil::fuzz::take_part(rest));
    const std::string name = is_recording_name(asked) ? asked : "take";
    std::filesystem::create_directory(folder.path() + "/" + name);
    for (const char* file : {"/recording.json", "/inputs.csv", "/poses.csv"}) {
        (void)folder.write(name + file, tricoil::fuzz::take_part(rest));
    }
    const web::RecordingLibrary library(folder.path());
    const nlohmann::json list = library.list();
    require(list.size() == 1 && list[0]["name"] == name && nlohmann::json::accept(list.dump()));
    try {
        check_sent(library.open(name));
    } catch (const InputError& refusal) {
        require(std::string_view(refusal.what()).find(folder.path()) == std::string_view::npos);
    }
    if (asked != name) {
        tricoil::fuzz::accept_or_refuse([&] {
            (void)library.open(asked);
            std::abort();  // no recording has this name
        });
    }
    std::filesystem::remove_all(folder.path() + "/" + name);
    return 0;
}
