// A line of text of bounded length, without a heap.
#pragma once

#include <array>
#include <cstdarg>
#include <cstdio>

namespace tricoil::drivers {

class Text {
public:
    /// Like printf; truncates text that is too long.
    __attribute__((format(printf, 2, 3))) void print(const char* format, ...) {
        va_list arguments;
        va_start(arguments, format);
        std::vsnprintf(text_.data(), text_.size(), format, arguments);
        va_end(arguments);
    }
    void clear() { text_[0] = '\0'; }
    [[nodiscard]] const char* c_str() const { return text_.data(); }

private:
    std::array<char, 320> text_{};
};

}  // namespace tricoil::drivers
