// Options of commands that are in the Python package alone, from python_commands.json: name, help, and kind with what else holds.
#include "board/host/commands/python_commands.hpp"  // generated
#include "board/host/commands/program.hpp"
#include "board/host/commands/reader_options.hpp"
#include "board/host/commands/stage_options.hpp"
#include "board/support/json_text.hpp"

namespace tricoil::host {
namespace {

/// An option whose value must be one of Value; Python reads it again.
template <typename Value>
CLI::Option* option(CLI::App* sub, const std::string& name, const std::string& help) {
    return sub->add_option_function<Value>(
        name, [](const Value& /*value*/) {}, help);
}

template <typename Value>
CLI::Option* list(CLI::App* sub, const std::string& name, const std::string& help) {
    return option<std::vector<Value>>(sub, name, help)->delimiter(',')->allow_extra_args(false);
}

std::string refuse_bad_ratio(const std::string& text) {
    const std::uint64_t ratio = number_from<std::uint64_t>(text).value_or(0);
    return ratio >= 2 && ratio <= 100'000 ? "" : text + " is not a whole number from 2 to 100000";
}

/// In lower case, or with | between words, the value is checked here. FILE? may be empty.
CLI::Option* add_option(CLI::App* sub, const std::string& name, const std::string& help, const std::string& kind) {
    using Add = CLI::Option* (*)(CLI::App*, const std::string&, const std::string&);
    static const std::map<std::string, Add> kKinds{
        {"number", option<double>},
        {"integer", option<int>},
        {"count", option<std::size_t>},
        {"text", option<std::string>},
        {"numbers", list<double>},
        {"texts", list<std::string>},
        {"xyz", [](auto* to, auto& n, auto& h) { return vector_xyz(list<double>(to, n, h)); }},
        {"pair", [](auto* to, auto& n, auto& h) { return numbers(list<double>(to, n, h), "A,B", 2); }},
        {"files", [](auto* to, auto& n, auto& h) { return option<std::vector<std::string>>(to, n, h)->type_name(kFileType); }},
        {"wiring", [](auto* to, auto& n, auto&) { return file_name(option<std::string>(to, n, kWiringHelp)); }},
        {kFileType, [](auto* to, auto& n, auto& h) { return file_name(option<std::string>(to, n, h)); }},
    };
    if (const auto found = kKinds.find(kind); found != kKinds.end()) {
        return found->second(sub, name, help);
    }
    if (const std::vector<std::string> words = CLI::detail::split(kind, '|'); words.size() > 1) {
        return one_of(option<std::string>(sub, name, help), words);
    }
    return sub->add_option(name)->description(help)->type_name(kind == "FILE?" ? kFileType : kind);
}

/// Adds the option, or the options of a group, and returns their names.
std::vector<std::string> add_entry(CLI::App* sub, const Json& listed, const std::string& kind, OutputOptions& stages) {
    const std::string name = listed[0];
    if (kind == "reader") {
        return add_reader_options(sub, listed[1]);
    }
    if (kind == "group") {
        return add_python_options(sub, name);
    }
    if (kind == "stages") {
        add_stage_options(sub, stages);
        return {};
    }
    if (kind == "flag") {
        sub->add_flag(name)->description(listed[1]);
    } else {
        add_option(sub, name, listed[1], kind);
    }
    return {name.substr(0, name.find(','))};
}

void add_listed(CLI::App* sub, const Json& listed, OutputOptions& stages) {
    const std::string kind = listed.size() > 2 ? listed[2].get<std::string>() : "flag";
    const std::vector<std::string> words = CLI::detail::split(kind, ' ');
    for (const std::string& name : add_entry(sub, listed, words[0], stages)) {
        CLI::Option* const added = sub->get_option(name);
        for (const std::string& word : words) {
            const std::string value = word.substr(word.find('=') + 1);
            if (word == "required") {
                added->required();
            } else if (word == "many") {
                added->expected(1)->multi_option_policy(CLI::MultiOptionPolicy::TakeAll);
            } else if (word.starts_with("default=")) {
                added->default_str(value);
            } else if (word.starts_with("type=")) {
                added->type_name(value);
            } else if (word.starts_with("most=")) {
                added->expected(1, std::stoi(value));
            } else if (word.starts_with("needs=")) {
                added->needs(sub->get_option(value));
            }
        }
    }
}

const Json& commands() {
    static const Json all = Json::parse(kPythonCommands);
    return all;
}

void add_command(CLI::App* sub, const Json& listed, Action& action) {
    if (listed.contains("commands")) {
        sub->require_subcommand(1);
        for (const auto& [name, command] : listed["commands"].items()) {
            add_command(sub->add_subcommand(name, command["about"]), command, action);
        }
        return;
    }
    const auto stages = std::make_shared<OutputOptions>();
    for (const Json& one : listed["options"]) {
        add_listed(sub, one, *stages);
    }
    std::vector<Example> examples;
    for (const Json& example : listed["examples"]) {
        examples.push_back({example[0], example[1]});
    }
    set_examples(sub, examples);
    sub->callback([stages, sub, &action] { action = [stages, sub] { return continue_in_python(*sub); }; });
}

}  // namespace

std::vector<std::string> add_python_options(CLI::App* sub, const std::string& group, const std::string& more_help) {
    std::vector<std::string> names;
    for (const Json& one : commands().at("groups").at(group)) {
        names.push_back(one[0]);
        if (sub->get_option_no_throw(names.back()) == nullptr) {
            add_option(sub, one[0], one[1].get<std::string>() + more_help, one[2]);
        }
    }
    return names;
}

std::vector<std::string> add_reader_options(CLI::App* sub, const std::string& two_files) {
    auto names = add_python_options(sub, "reader", two_files.empty() ? "" : "; " + two_files + " if they differ");
    const auto others = add_python_options(sub, "reader of one file");
    names.insert(names.end(), others.begin(), others.end());
    return names;
}

bool is_in_python(const std::string& command) { return commands().contains(command); }

void add_python_command(CLI::App* sub, Action& action) {
    add_command(sub, commands().at(sub->get_name()), action);
    if (CLI::Option* const ratio = sub->get_option_no_throw("--ratio"); ratio != nullptr) {
        ratio->check(refuse_bad_ratio);
    }
}

}  // namespace tricoil::host
