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
        refuse_if(!seen.insert(error ? path : canonical).second, "{}: given twice; give each file once", path);
    }
}

void refuse_input_as_output(const std::string& option, const std::string& output, const std::vector<std::string>& inputs) {
    for (const std::string& input : inputs) {
        std::error_code error;
        refuse_if(std::filesystem::equivalent(input, output, error), "{} {}: is also an input file; choose another file", option,
                  output);
    }
}

}  // namespace tricoil::host
