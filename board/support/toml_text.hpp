// Vectors and matrices as TOML.
#pragma once

#include <fmt/format.h>

#include <string>

#include "core/linear/matrix.hpp"

namespace tricoil::host {

/// Reads back as the same bits.
inline std::string toml_text(const Vec3<double>& v) { return fmt::format("[{:.17g}, {:.17g}, {:.17g}]", v(0), v(1), v(2)); }

/// Three rows.
inline std::string toml_text(const Mat3<double>& m) {
    return fmt::format("[\n  {},\n  {},\n  {},\n]", toml_text(Vec3<double>(m.row(0))), toml_text(Vec3<double>(m.row(1))),
                       toml_text(Vec3<double>(m.row(2))));
}

}  // namespace tricoil::host
