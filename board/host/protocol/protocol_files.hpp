// Exports the protocol schema as DBC file and Markdown page.
#pragma once

#include <string>

namespace tricoil::host {

/// DBC file of all messages of fixed length that fit into a CAN FD frame, for node 0.
std::string dbc_file();

/// Protocol description in Markdown.
std::string protocol_page();

}  // namespace tricoil::host
