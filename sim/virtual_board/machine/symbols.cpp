#include "sim/virtual_board/machine/symbols.hpp"

#include <cxxabi.h>
#include <elf.h>
#include <fmt/format.h>

#include <algorithm>
#include <cstdlib>
#include <cstring>
#include <memory>
#include <stdexcept>

namespace tricoil::virtual_board {
namespace {

std::string demangled(const std::string& name) {
    int status = 0;
    const std::unique_ptr<char, void (*)(void*)> text(abi::__cxa_demangle(name.c_str(), nullptr, nullptr, &status), std::free);
    return text ? text.get() : name;
}

/// Reads a structure at an offset of the file.
template <typename T>
T take(std::span<const char> file, std::size_t at) {
    if (at + sizeof(T) > file.size()) {
        throw std::invalid_argument("file is truncated");
    }
    T value;
    std::memcpy(&value, file.data() + at, sizeof value);
    return value;
}

std::string text_at(std::span<const char> file, std::size_t at) {
    const auto end = at < file.size() ? std::find(file.begin() + static_cast<std::ptrdiff_t>(at), file.end(), '\0') : file.end();
    return at < file.size() ? std::string(file.begin() + static_cast<std::ptrdiff_t>(at), end) : std::string();
}

}  // namespace

Symbols::Symbols(std::span<const char> file) {
    const auto head = take<Elf32_Ehdr>(file, 0);
    if (std::memcmp(head.e_ident, ELFMAG, SELFMAG) != 0 || head.e_ident[EI_CLASS] != ELFCLASS32 || head.e_machine != EM_ARM) {
        throw std::invalid_argument("not an ELF file for 32-bit Arm");
    }
    for (unsigned n = 0; n < head.e_shnum; ++n) {
        const auto section = take<Elf32_Shdr>(file, head.e_shoff + std::size_t{n} * head.e_shentsize);
        if (section.sh_type != SHT_SYMTAB) {
            continue;
        }
        const auto names = take<Elf32_Shdr>(file, head.e_shoff + std::size_t{section.sh_link} * head.e_shentsize);
        for (std::size_t at = 0; at < section.sh_size; at += sizeof(Elf32_Sym)) {
            const auto symbol = take<Elf32_Sym>(file, section.sh_offset + at);
            const std::string name = text_at(file, names.sh_offset + symbol.st_name);
            const unsigned type = ELF32_ST_TYPE(symbol.st_info);
            if (name.empty() || name.front() == '$' || type == STT_SECTION || type == STT_FILE) {
                continue;
            }
            by_name_[name] = symbol.st_value;
            if (type == STT_FUNC) {
                by_address_[symbol.st_value & ~1U] = demangled(name);
            }
        }
    }
    if (by_name_.empty()) {
        throw std::invalid_argument("no symbols");
    }
}

std::string Symbols::name_of(std::uint32_t address) const {
    const auto after = by_address_.upper_bound(address);
    if (after == by_address_.begin()) {
        return "";
    }
    const auto& [start, name] = *std::prev(after);
    return address == start ? name : fmt::format("{}+{:#x}", name, address - start);
}

std::optional<std::uint32_t> Symbols::address_of(const std::string& name) const {
    const auto found = by_name_.find(name);
    return found == by_name_.end() ? std::nullopt : std::optional(found->second);
}

}  // namespace tricoil::virtual_board
