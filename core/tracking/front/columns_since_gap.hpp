// Number of columns since the last one that was lost or refused.
#pragma once

#include <algorithm>

namespace tricoil::tracking {

class ColumnsSinceGap {
public:
    /// Columns after a gap whose poses are flagged `columns_missing`: two signal matrices.
    static constexpr int kFlagged = 6;

    void refuse() { count_ = 0; }
    /// Counts `columns` good columns; `after_gap`: columns before them were lost or refused.
    void add(int columns, bool after_gap) { count_ = std::min((after_gap ? 0 : count_) + columns, kFlagged + 1); }
    [[nodiscard]] bool is_recent() const { return count_ <= kFlagged; }

private:
    int count_ = kFlagged + 1;
};

}  // namespace tricoil::tracking
