#include "board/command_line/word_walk.hpp"

#include <algorithm>
#include <cctype>

#include "board/command_line/usage_error.hpp"

namespace tricoil::host {
namespace {

/// "-" (standard input or output) and negative numbers are values.
bool looks_like_option(const std::string& word) {
    return word.size() > 1 && word[0] == '-' && word[1] != '.' && std::isdigit(static_cast<unsigned char>(word[1])) == 0;
}

const CLI::App* find_command(const CLI::App& command, const std::string& word) {
    const auto commands = commands_of(command);
    const auto found = std::find_if(commands.begin(), commands.end(), [&](const auto* one) { return one->get_name() == word; });
    return found == commands.end() ? nullptr : *found;
}

const CLI::Option* find_option(const CLI::App& command, const std::string& name) {
    const auto all =
        command.get_options([&](const CLI::Option* option) { return option->nonpositional() && option->check_name(name); });
    return all.empty() ? nullptr : all.front();
}

class Walker {
public:
    explicit Walker(const CLI::App& program) { walk_.command = &program; }

    void take(const std::string& word) {
        if (walk_.open_option != nullptr && !is_own_option(word)) {
            if (word.empty()) {  // CLI11 would take it as zero
                complain(missing_value(*walk_.command, *walk_.open_option));
            }
            walk_.open_option = nullptr;
        } else if (walk_.options_ended || !looks_like_option(word)) {
            take_bare(word);
        } else if (word == "--") {
            walk_.options_ended = true;
        } else {
            take_option(word);
        }
    }

    [[nodiscard]] WordWalk result() const { return walk_; }

private:
    [[nodiscard]] bool is_own_option(const std::string& word) const {
        return looks_like_option(word) && find_option(*walk_.command, word.substr(0, word.find('='))) != nullptr;
    }

    void complain(const std::string& what) { walk_.error = walk_.error.empty() ? what : walk_.error; }

    void take_bare(const std::string& word) {
        const CLI::App* const next = walk_.arguments == 0 ? find_command(*walk_.command, word) : nullptr;
        if (next != nullptr) {
            walk_.command = next;
            return;
        }
        if (walk_.arguments == 0 && !commands_of(*walk_.command).empty()) {
            complain(unknown_command(*walk_.command, word));
        }
        ++walk_.arguments;
    }

    void take_option(const std::string& word) {
        if (walk_.open_option != nullptr) {
            complain(missing_value(*walk_.command, *walk_.open_option));
            walk_.open_option = nullptr;
        }
        const auto equals = word.find('=');
        const CLI::Option* const option = find_option(*walk_.command, word.substr(0, equals));
        if (option == nullptr) {
            complain(unknown_option(*walk_.command, word.substr(0, equals)));
        } else if (is_help(*option)) {
            walk_.wants_help = true;
        } else if (is_flag(*option)) {
            if (equals != std::string::npos) {
                complain(unexpected_value(*walk_.command, *option));
            }
        } else if (equals == std::string::npos) {
            walk_.open_option = option;
        } else if (equals + 1 == word.size()) {  // CLI11 would take the next word
            complain(missing_value(*walk_.command, *option));
        }
    }

    WordWalk walk_;
};

}  // namespace

WordWalk walk_words(const CLI::App& program, std::span<const std::string> words) {
    Walker walker(program);
    for (const std::string& word : words) {
        walker.take(word);
    }
    return walker.result();
}

}  // namespace tricoil::host
