// Commit of the tree from which the program was built.
#pragma once

namespace tricoil::host {

/// "0123456789ab", with ", modified" if files differed; empty: unknown.
const char* build_commit();

}  // namespace tricoil::host
