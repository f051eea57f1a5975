// Draws pictures with Python: _draw.py, beside this program or this Python package, has the curves of each picture.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "board/support/interrupt.hpp"
#include "board/support/whole_file.hpp"

namespace tricoil::host {

/// Draws into `folder`, which contains the CSV files, with the python3 of PATH, or the system's if that one has no matplotlib.
/// words: the pictures, and what else _draw.py takes. Returns the last line that it printed. Throws InputError if Python or
/// matplotlib is not installed or cannot draw. After a signal it stops Python and throws Interrupted.
std::string draw(const std::filesystem::path& folder, const std::vector<std::string>& words, const InterruptGuard& guard);

/// Draws into the folder and publishes it. If draw() throws InputError, the CSV files are published, and the error names their
/// folder `target`.
void draw_and_publish(StagedFolder& folder, const std::string& target, const std::vector<std::string>& pictures,
                      const InterruptGuard& guard);

}  // namespace tricoil::host
