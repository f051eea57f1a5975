#include "board/support/components.hpp"

#include <fmt/format.h>

#include "board/support/component_rows.hpp"
#include "board/support/errors.hpp"

namespace tricoil::host {
namespace {

const ComponentRow& row_of(Component component) { return kComponentRows[static_cast<std::size_t>(component)]; }

}  // namespace

bool is_built(Component component) { return row_of(component).is_built; }

void require(Component component, const std::string& user) {
    if (const auto& [name, packages, built] = row_of(component); !built) {
        throw InputError(fmt::format("{}: built without the component {}; install {}, then configure with -DTRICOIL_WITH_{}=ON",
                                     user, name, packages, name));
    }
}

}  // namespace tricoil::host
