// Names of a firmware's functions and objects, from its ELF file.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>

namespace tricoil::virtual_board {

class Symbols {
public:
    Symbols() = default;
    /// Throws sim::InputError: not there, not an ELF file of 32 bits with symbols.
    explicit Symbols(const std::string& elf_path);

    /// "tricoil::app::start()+0x12"; "" if unknown.
    [[nodiscard]] std::string name_of(std::uint32_t address) const;
    /// By its name in the file.
    [[nodiscard]] std::optional<std::uint32_t> address_of(const std::string& name) const;

private:
    std::map<std::uint32_t, std::string> by_address_;
    std::map<std::string, std::uint32_t> by_name_;
};

}  // namespace tricoil::virtual_board
