// Vectors and matrices in JSON output of commands.
#pragma once

#include "board/support/json_text.hpp"
#include "core/linear/matrix.hpp"

namespace tricoil::host {

inline Json list_of(const Vec3<double>& v) { return {v(0), v(1), v(2)}; }

/// A list of three rows.
inline Json rows_of(const Mat3<double>& m) {
    Json rows = Json::array();
    for (Index i = 0; i < 3; ++i) {
        rows.push_back({m(i, 0), m(i, 1), m(i, 2)});
    }
    return rows;
}

}  // namespace tricoil::host
