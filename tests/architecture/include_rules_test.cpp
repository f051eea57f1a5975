// Who may include whom: core <- hal <- drivers, sim, board/app <- board/*. Reads the sources, so that no build flag can hide a
// breach.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <regex>
#include <set>
#include <string>
#include <vector>

namespace {

namespace fs = std::filesystem;

/// Standard headers that need an operating system, a heap or run-time types: not for code that also runs on a board.
const std::set<std::string> kHosted{"iostream", "fstream", "sstream", "string",        "vector",     "map",
                                    "set",      "thread",  "mutex",   "filesystem",    "functional", "memory",
                                    "deque",    "list",    "regex",   "unordered_map", "future",     "condition_variable",
                                    "stdexcept"};

struct Layer {
    std::string folder;
    std::vector<std::string> may_include;  // prefixes of project headers
    bool freestanding;
};

const std::vector<Layer> kLayers{
    {"core", {"core/"}, true},
    {"hal", {"core/", "hal/"}, true},
    {"drivers", {"core/", "hal/", "drivers/"}, false},
    {"sim", {"core/", "hal/", "sim/"}, false},
    {"board/app", {"core/", "hal/", "board/app/"}, true},
};

struct Include {
    std::string file;
    std::string header;
    bool angled;
};

std::vector<Include> includes_of(const std::string& folder) {
    static const std::regex pattern("^\\s*#\\s*include\\s*([<\"])([^>\"]+)[>\"]");
    std::vector<Include> includes;
    for (const auto& entry : fs::recursive_directory_iterator(fs::path(TRICOIL_SOURCE_DIR) / folder)) {
        if (entry.path().extension() != ".hpp" && entry.path().extension() != ".cpp") {
            continue;
        }
        std::ifstream file(entry.path());
        std::smatch match;
        for (std::string line; std::getline(file, line);) {
            if (std::regex_search(line, match, pattern)) {
                includes.push_back({entry.path().string(), match[2], match[1] == "<"});
            }
        }
    }
    return includes;
}

bool is_project_header(const std::string& header) {
    static const std::vector<std::string> roots{"core/", "hal/", "drivers/", "sim/", "board/", "tests/"};
    return std::any_of(roots.begin(), roots.end(), [&](const std::string& root) { return header.starts_with(root); });
}

/// Why `layer` may not include `header`; empty if it may.
std::string breach(const Layer& layer, const Include& include) {
    const std::string& header = include.header;
    if (is_project_header(header)) {
        const bool allowed = std::any_of(layer.may_include.begin(), layer.may_include.end(),
                                         [&](const std::string& prefix) { return header.starts_with(prefix); });
        return allowed ? "" : layer.folder + " must not include " + header;
    }
    if (!layer.freestanding || header.starts_with("Eigen/")) {
        return "";
    }
    const bool os_header = header.ends_with(".h");
    const bool foreign = header.find('/') != std::string::npos;
    return os_header || foreign || kHosted.contains(header) ? layer.folder + " must not include <" + header + ">" : "";
}

TEST(IncludeRules, EveryLayerKeepsThem) {
    for (const Layer& layer : kLayers) {
        if (!fs::exists(fs::path(TRICOIL_SOURCE_DIR) / layer.folder)) {
            continue;
        }
        const auto includes = includes_of(layer.folder);
        EXPECT_TRUE(layer.folder == "drivers" || !includes.empty()) << layer.folder;
        for (const Include& include : includes) {
            EXPECT_EQ(breach(layer, include), "") << include.file;
        }
    }
}

TEST(IncludeRules, ABreachWouldBeSeen) {
    EXPECT_NE(breach(kLayers[0], {"x", "hal/clock.hpp", false}), "");
    EXPECT_NE(breach(kLayers[0], {"x", "unistd.h", true}), "");
    EXPECT_NE(breach(kLayers[0], {"x", "linux/can.h", true}), "");
    EXPECT_NE(breach(kLayers[0], {"x", "vector", true}), "");
    EXPECT_NE(breach(kLayers[2], {"x", "sim/motion/motion.hpp", false}), "");
    EXPECT_NE(breach(kLayers[4], {"x", "board/support/errors.hpp", false}), "");
    EXPECT_EQ(breach(kLayers[0], {"x", "cmath", true}), "");
    EXPECT_EQ(breach(kLayers[0], {"x", "Eigen/Core", true}), "");
}

TEST(Tree, EveryFolderOfSourcesHasAReadme) {
    const fs::path root(TRICOIL_SOURCE_DIR);
    for (const char* top : {"core", "hal", "drivers", "sim", "board", "tests", "toolchain"}) {
        EXPECT_TRUE(fs::exists(root / top / "README.md")) << top;
        for (const auto& entry : fs::directory_iterator(root / top)) {
            if (entry.is_directory() && !fs::is_empty(entry)) {
                EXPECT_TRUE(fs::exists(entry.path() / "README.md")) << entry.path();
            }
        }
    }
}

}  // namespace
