#include "board/support/shell_word.hpp"

namespace tricoil::host {

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

}  // namespace tricoil::host
