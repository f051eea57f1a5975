// Files that a command names: none twice, and no input as output.
#pragma once

#include <string>
#include <vector>

namespace tricoil::host {

/// Throws InputError for a file that is given twice.
void refuse_repeated(const std::vector<std::string>& paths);

/// Throws InputError, naming the option, if its output file is one of the inputs. Files that do not exist are distinct.
void refuse_input_as_output(const std::string& option, const std::string& output, const std::vector<std::string>& inputs);

}  // namespace tricoil::host
