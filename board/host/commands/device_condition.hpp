// Condition of a device: last program error, image and settings, as text and JSON.
#pragma once

#include <string>
#include <vector>

#include "board/support/json_text.hpp"
#include "core/protocol/messages.hpp"

namespace tricoil::host {

/// Keys of tricoil device info.
[[nodiscard]] Json condition_json(const protocol::ConditionMessage& m);

/// Supply voltage and temperature; null: not measured.
[[nodiscard]] Json supply_json(const protocol::StatusMessage& m);

/// One sentence for each problem, with its remedy.
[[nodiscard]] std::vector<std::string> condition_warnings(const protocol::ConditionMessage& m);

/// Value of the key "crash" in one line.
[[nodiscard]] std::string crash_text(const Json& crash);

}  // namespace tricoil::host
