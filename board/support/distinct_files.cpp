#include "board/support/distinct_files.hpp"

#include <fmt/format.h>

#include <filesystem>
#include <map>
#include <set>

#include "board/support/errors.hpp"
#include "board/support/output_file.hpp"

namespace tricoil::host {

void refuse_repeated(const std::vector<std::string>& paths) {
    std::set<std::string> seen;
    for (const std::string& path : paths) {
        std::error_code error;
        const auto canonical = std::filesystem::weakly_canonical(path, error).string();
        refuse_if(!seen.insert(error ? path : canonical).second, "{}: given twice; give each file once", path);
    }
}

void check_outputs(const std::vector<OptionFile>& outputs, const std::vector<std::string>& inputs) {
    namespace fs = std::filesystem;
    std::map<std::string, const char*> seen;
    for (const auto& [option, path] : outputs) {
        std::error_code error;
        for (const std::string& input : inputs) {
            refuse_if(fs::equivalent(input, path, error), "{} {}: is also an input file; choose another file", option, path);
        }
        const fs::file_status status = fs::status(path, error);
        if (path.empty() || path == kStandardOutput || (fs::exists(status) && !fs::is_regular_file(status))) {
            continue;
        }
        const auto [other, is_new] = seen.try_emplace(fs::weakly_canonical(fs::absolute(path), error).string(), option);
        refuse_if(!is_new, "{} and {} name the same file; choose two files", other->second, option);
    }
}

}  // namespace tricoil::host
