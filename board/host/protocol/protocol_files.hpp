// The schema as files that other programs and people read.
#pragma once

#include <string>

namespace tricoil::host {

/// A DBC file of every message that fits a CAN FD frame, for node 0.
std::string dbc_file();

/// The protocol in words and tables, Markdown.
std::string protocol_page();

}  // namespace tricoil::host
