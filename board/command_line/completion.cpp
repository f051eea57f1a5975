#include "board/command_line/completion.hpp"

#include <fmt/format.h>

#include "board/command_line/shell_scripts.hpp"  // generated
#include "board/command_line/word_walk.hpp"
#include "board/support/nearest_name.hpp"

namespace tricoil::host {
namespace {

const std::string kFileRequest = std::string(kFiles) + "\n";
const std::string kFolderRequest = ":folder\n";

class Offer {
public:
    explicit Offer(std::string typed) : typed_(std::move(typed)) {}

    void add(const std::string& word, const std::string& meaning) {
        if (word.starts_with(typed_)) {
            text_ += fmt::format("{}\t{}\n", word, meaning.substr(0, meaning.find('\n')));
        }
    }
    /// `before`: text before the value in the same word, as in --out=FILE.
    void add_values(const CLI::Option& option, const ValueSources& sources, const std::string& before = "") {
        const std::string type = type_of(option);
        text_ += type == kFileType ? kFileRequest : type == kFolderType ? kFolderRequest : "";
        for (const Candidate& value : values_of(option, sources)) {
            if (value.word + "\n" == kFileRequest) {
                text_ += kFileRequest;
            } else {
                add(before + value.word, value.meaning);
            }
        }
    }
    [[nodiscard]] std::string text() const { return text_; }

private:
    std::string typed_;
    std::string text_;
};

/// The option of the word --name=...; null for any other word.
const CLI::Option* option_of_word(const CLI::App& command, const std::string& word) {
    const auto equals = word.find('=');
    if (equals == std::string::npos || !word.starts_with("--")) {
        return nullptr;
    }
    return find_option(command, word.substr(0, equals));
}

}  // namespace

std::string candidates_for(const CLI::App& program, std::span<const std::string> words, const ValueSources& sources) {
    if (words.empty()) {
        return "";
    }
    const std::string& typed = words.back();
    const WordWalk before = walk_words(program, words.first(words.size() - 1));
    const CLI::App& command = *before.command;
    Offer offer(typed);
    if (before.open_option != nullptr) {
        offer.add_values(*before.open_option, sources);
        return offer.text();
    }
    if (const CLI::Option* const option = option_of_word(command, typed); option != nullptr) {
        offer.add_values(*option, sources, typed.substr(0, typed.find('=') + 1));
        return offer.text();
    }
    if (typed.starts_with('-') && !before.options_ended) {
        for (const CLI::Option* option : options_of(command)) {
            offer.add(shown_name(*option), option->get_description());
        }
        offer.add("--help", "help of this command");
        return offer.text();
    }
    if (before.arguments == 0) {
        for (const CLI::App* one : commands_of(command)) {
            offer.add(one->get_name(), one->get_description());
        }
    }
    const auto arguments = arguments_of(command);
    if (!arguments.empty()) {
        offer.add_values(*arguments[std::min(before.arguments, arguments.size() - 1)], sources);
    }
    return offer.text();
}

const std::vector<std::string>& shell_names() {
    static const std::vector<std::string> names{"bash", "zsh", "fish"};
    return names;
}

std::string completion_script(const std::string& shell) { return kShellScripts[index_of_name("shell", shell, shell_names())]; }

}  // namespace tricoil::host
