#include "board/command_line/word_walk.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cctype>

#include "board/support/nearest_name.hpp"

namespace tricoil::host {
namespace {

std::string with_pointer(const CLI::App& command, const std::string& what) {
    return fmt::format("{}{} {} --help", what, what.ends_with('?') ? " See" : "; see", command_path(command));
}

std::vector<std::string> names_of(const std::vector<const CLI::App*>& commands) {
    std::vector<std::string> names;
    for (const CLI::App* command : commands) {
        names.push_back(command->get_name());
    }
    return names;
}

const CLI::App& selected_command(const CLI::App& program) {
    const auto selected = program.get_subcommands();  // those that were parsed
    return selected.empty() ? program : selected_command(*selected.front());
}

/// The option whose name is a whole word of the text; null: none.
const CLI::Option* option_in(const CLI::App& command, const std::string& text) {
    const auto is_in = [&](const CLI::Option* option) {
        const std::string name = option->get_name();
        const auto at = text.find(name);
        const auto end = at + name.size();
        return !name.empty() && at != std::string::npos && (at == 0 || text[at - 1] == ' ') &&
               (end == text.size() || std::string_view(" :,").find(text[end]) != std::string_view::npos);
    };
    const auto found = command.get_options(is_in);
    return found.empty() ? nullptr : found.front();
}

std::string joined(const std::vector<std::string>& words) { return fmt::format("{}", fmt::join(words, ",")); }

/// Requirement on the values of an option.
std::string expectation(const CLI::Option& option) {
    const int count = option.get_items_expected_max();
    const std::string type = type_of(option);
    if (option.get_delimiter() == ',' && count > 1) {
        return fmt::format("{} comma-separated numbers", count);
    }
    return type == "N" ? "a whole number" : type == "TEXT" ? "a text" : type == "NUMBER" ? "a number" : "a number, " + type;
}

/// Options and arguments that accept the word as value.
std::string option_for(const CLI::App& command, const std::string& word, const ValueSources& sources) {
    for (const CLI::Option* option : options_of(command)) {
        const auto values = values_of(*option, sources);
        if (std::any_of(values.begin(), values.end(), [&](const Candidate& value) { return value.word == word; })) {
            return shown_name(*option);
        }
    }
    return "";
}

std::string unexpected_argument(const CLI::App& command, const ValueSources& sources) {
    const auto words = command.remaining();
    if (words.empty()) {
        return "wrong usage";
    }
    const std::string option = option_for(command, words.front(), sources);
    return option.empty() ? fmt::format("unexpected argument '{}'", words.front())
                          : fmt::format("unexpected argument '{0}'; did you mean '{1} {0}'?", words.front(), option);
}

std::string missing_option(const CLI::App& command) {
    const auto missing =
        command.get_options([](const CLI::Option* option) { return option->get_required() && option->count() == 0; });
    if (missing.empty()) {
        return "";
    }
    const CLI::Option& first = *missing.front();
    const std::string type = first.nonpositional() ? type_of(first) + ": " : "";
    return fmt::format("{} is required ({}{})", shown_name(first), type, first.get_description());
}

/// Other kinds of the same command that take the option.
std::string commands_with(const CLI::App& command, const std::string& option) {
    std::string paths;
    const CLI::App* const parent = command.get_parent();
    for (const CLI::App* one : parent == nullptr ? std::vector<const CLI::App*>{} : commands_of(*parent)) {
        const auto options = parent->get_parent() == nullptr ? std::vector<const CLI::Option*>{} : options_of(*one);
        if (std::ranges::any_of(options, [&](const CLI::Option* o) { return o->check_name(option); })) {
            paths += (paths.empty() ? "" : ", ") + command_path(*one);
        }
    }
    return paths;
}

}  // namespace

std::string unknown_command(const CLI::App& command, const std::string& word) {
    const auto names = names_of(commands_of(command));
    const std::string nearest = nearest_name(word, names);
    return fmt::format("unknown command '{}'; {}choices: {}", word, nearest.empty() ? "" : "did you mean '" + nearest + "'? ",
                       fmt::join(names, ", "));
}

std::string unknown_option(const CLI::App& command, const std::string& word) {
    std::vector<std::string> names;
    for (const CLI::Option* option : options_of(command)) {
        for (const std::string& name : option->get_lnames()) {
            names.push_back(name);
        }
    }
    const std::string nearest = nearest_name(word.substr(std::min(word.size(), word.find_first_not_of('-'))), names);
    if (const std::string others = commands_with(command, word); !others.empty()) {
        return with_pointer(command, fmt::format("{} is an option of {}, not of {}", word, others, command_path(command)));
    }
    return with_pointer(command, fmt::format("unknown option '{}'", word) +
                                     (nearest.empty() ? "" : fmt::format("; did you mean '--{}'?", nearest)));
}

std::string missing_value(const CLI::App& command, const CLI::Option& option) {
    return with_pointer(command, fmt::format("{} needs a value: {}", shown_name(option), type_of(option)));
}

std::string unexpected_value(const CLI::App& command, const CLI::Option& flag) {
    return with_pointer(command, shown_name(flag) + " takes no value");
}

std::string missing_command(const CLI::App& command) {
    return fmt::format("{} needs a command: {}", command_path(command), fmt::join(names_of(commands_of(command)), ", "));
}

std::string text_of(const CLI::ParseError& error, const CLI::App& program, const ValueSources& sources) {
    const CLI::App& command = selected_command(program);
    const std::string text = error.what();
    if (!command.remaining().empty()) {
        return with_pointer(command, unexpected_argument(command, sources));
    }
    if (dynamic_cast<const CLI::RequiredError*>(&error) != nullptr) {
        const std::string missing = missing_option(command);
        return missing.empty() ? missing_command(command) : with_pointer(command, missing);
    }
    const CLI::Option* const option = option_in(command, text);
    if (option == nullptr) {
        return with_pointer(command, text);
    }
    const auto& given = option->results();
    if (dynamic_cast<const CLI::ConversionError*>(&error) != nullptr) {
        return with_pointer(command, fmt::format("{} {}: expected {}", shown_name(*option), joined(given), expectation(*option)));
    }
    if (dynamic_cast<const CLI::ArgumentMismatch*>(&error) != nullptr) {
        return with_pointer(command,
                            option->get_items_expected_max() == 1
                                ? fmt::format("{} is given {} times; give it once", shown_name(*option), given.size())
                                : fmt::format("{} {}: expected {}", shown_name(*option), joined(given), expectation(*option)));
    }
    return with_pointer(command, text);
}

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
            walk_.unknown_command = walk_.unknown_command || walk_.error.empty();
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
