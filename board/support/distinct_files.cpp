#include "board/support/distinct_files.hpp"

#include <fmt/format.h>

#include <filesystem>
#include <set>

#include "board/support/errors.hpp"

namespace tricoil::host {

void refuse_repeated(const std::vector<std::string>& paths) {
    std::set<std::string> seen;
    for (const std::string& path : paths) {
        std::error_code error;
        const auto canonical = std::filesystem::weakly_canonical(path, error).string();
        if (!seen.insert(error ? path : canonical).second) {
            throw InputError(path + ": given twice; give each file once");
        }
    }
}

void refuse_input_as_output(const std::string& option, const std::string& output, const std::vector<std::string>& inputs) {
    for (const std::string& input : inputs) {
        std::error_code error;
        if (std::filesystem::equivalent(input, output, error)) {
            throw InputError(fmt::format("{} {}: is also an input file; choose another file", option, output));
        }
    }
}

}  // namespace tricoil::host
