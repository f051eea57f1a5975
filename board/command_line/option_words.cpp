#include "board/command_line/option_words.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cctype>
#include <filesystem>
#include <sstream>

namespace tricoil::host {
namespace {

constexpr char kBetweenChoices = '|';

std::vector<std::string> split_choices(const std::string& text) {
    std::vector<std::string> words;
    std::size_t begin = 0;
    for (std::size_t end = 0; end != std::string::npos; begin = end + 1) {
        end = text.find(kBetweenChoices, begin);
        words.push_back(text.substr(begin, end == std::string::npos ? end : end - begin));
    }
    return words;
}

}  // namespace

CLI::Option* one_of(CLI::Option* option, const std::vector<std::string>& words) {
    return option->type_name(fmt::format("{}", fmt::join(words, std::string(1, kBetweenChoices))));
}

void set_examples(CLI::App* command, const std::vector<Example>& examples) {
    std::string text;
    for (const Example& example : examples) {
        text += fmt::format("# {}\n{}\n", example.what, example.line);
    }
    command->footer(text);
}

std::vector<std::string> example_lines(const CLI::App& command) {
    std::vector<std::string> all;
    std::istringstream text(command.get_footer());
    for (std::string line; std::getline(text, line);) {
        all.push_back(line);
    }
    for (const CLI::App* one : all.empty() ? commands_of(command) : std::vector<const CLI::App*>{}) {
        const auto more = example_lines(*one);
        all.insert(all.end(), more.begin(), more.end());
    }
    return all;
}

std::string command_path(const CLI::App& command) {
    const CLI::App* const parent = command.get_parent();
    return parent == nullptr ? std::filesystem::path(command.get_name()).filename().string()
                             : command_path(*parent) + " " + command.get_name();
}

std::string shown_name(const CLI::Option& option) {
    std::string name = option.get_name();
    if (!option.nonpositional()) {
        std::transform(name.begin(), name.end(), name.begin(),
                       [](unsigned char c) { return static_cast<char>(std::toupper(c)); });
    }
    return name;
}

std::string type_of(const CLI::Option& option) {
    if (is_flag(option)) {
        return "";
    }
    const std::string full = option.get_type_name();
    const std::string name = full.substr(0, full.find(':'));  // CLI11 appends the descriptions of the checks
    static const std::map<std::string, std::string> kPlain{{"FLOAT", "NUMBER"}, {"INT", "N"}, {"UINT", "N"}};
    const auto plain = kPlain.find(name);
    return plain == kPlain.end() ? name : plain->second;
}

std::vector<std::string> choices_of(const CLI::Option& option) {
    const std::string type = type_of(option);
    return type.find(kBetweenChoices) == std::string::npos ? std::vector<std::string>{} : split_choices(type);
}

std::vector<Candidate> values_of(const CLI::Option& option, const ValueSources& sources) {
    std::vector<Candidate> values;
    for (const std::string& choice : choices_of(option)) {
        values.push_back({choice, ""});
    }
    const auto source = sources.find(type_of(option));
    return source == sources.end() ? values : source->second();
}

bool is_flag(const CLI::Option& option) { return option.get_items_expected_max() == 0; }

bool is_help(const CLI::Option& option) { return option.check_lname("help"); }

std::vector<const CLI::Option*> options_of(const CLI::App& command) {
    return command.get_options([](const CLI::Option* option) { return option->nonpositional() && !is_help(*option); });
}

std::vector<const CLI::Option*> arguments_of(const CLI::App& command) {
    return command.get_options([](const CLI::Option* option) { return !option->nonpositional(); });
}

std::vector<const CLI::App*> commands_of(const CLI::App& command) { return command.get_subcommands({}); }

std::string shell_word(const std::string& text) {
    constexpr const char* kPlain = "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789_./:,+-";
    if (!text.empty() && text.front() != '-' && text.find_first_not_of(kPlain) == std::string::npos) {
        return text;
    }
    std::string word = text.starts_with('-') ? "'./" : "'";
    for (const char c : text) {
        word += c == '\'' ? std::string("'\\''") : std::string(1, c);
    }
    return word + "'";
}

const CLI::Option* find_option(const CLI::App& command, const std::string& name) {
    const auto all =
        command.get_options([&](const CLI::Option* option) { return option->nonpositional() && option->check_name(name); });
    return all.empty() ? nullptr : all.front();
}

}  // namespace tricoil::host
