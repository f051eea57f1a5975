// Function and object names of a firmware, from its ELF file.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <span>
#include <string>

namespace tricoil::virtual_board {

class Symbols {
public:
    Symbols() = default;
    /// Throws std::invalid_argument: not an ELF file for 32-bit Arm with symbols.
    explicit Symbols(std::span<const char> elf_file);

    /// "tricoil::app::start()+0x12"; "" if unknown.
    [[nodiscard]] std::string name_of(std::uint32_t address) const;
    /// Looks up a name exactly as written in the file.
    [[nodiscard]] std::optional<std::uint32_t> address_of(const std::string& name) const;

private:
    std::map<std::uint32_t, std::string> by_address_;
    std::map<std::string, std::uint32_t> by_name_;
};

}  // namespace tricoil::virtual_board
