# Writes circuit_results.hpp: the results of the board's netlists, for the virtual board.
#   cmake -DRESULTS=results.csv -DHEADER=circuit_results.hpp -P circuit_results.cmake
file(STRINGS "${RESULTS}" lines REGEX "^(coils|drive|slot|preamplifier|reference)[.][a-z0-9_.]+,")
list(LENGTH lines count)
set(rows "")
foreach(line IN LISTS lines)
  string(REGEX REPLACE "^([^,]+),(.+)$" "    {\"\\1\", \\2},\n" row "${line}")
  string(APPEND rows "${row}")
endforeach()
file(WRITE "${HEADER}" "// Made from results.csv by circuit_results.cmake.
#pragma once

#include <array>
#include <string_view>
#include <utility>

namespace tricoil::virtual_board {

inline constexpr std::array<std::pair<std::string_view, double>, ${count}> kCircuitResults{{
${rows}}};

/// A result of the netlists in board/nucleo_g474re/circuits. An unknown name is a compiler error.
consteval double circuit_result(std::string_view name) {
    for (const auto& [known, value] : kCircuitResults) {
        if (known == name) {
            return value;
        }
    }
    throw \"no such result in results.csv\";
}

}  // namespace tricoil::virtual_board
")
