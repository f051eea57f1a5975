// Files that a command names: none twice, and no input or other output as output.
#pragma once

#include <string>
#include <vector>

namespace tricoil::host {

/// Throws InputError for a file that is given twice.
void refuse_repeated(const std::vector<std::string>& paths);

struct OptionFile {
    const char* option;
    std::string path;  // empty: none
};

/// Throws InputError, naming the option, if an output file is one of the inputs, or the output of another option. Pipes, devices
/// and standard output may be named twice.
void check_outputs(const std::vector<OptionFile>& outputs, const std::vector<std::string>& inputs);

}  // namespace tricoil::host
