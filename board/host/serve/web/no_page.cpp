// Replaces the generated page if the program is built without it (TRICOIL_WEB=OFF).
#include "board/host/serve/web/page_text.hpp"

namespace tricoil::host::web {
const std::string_view kPage;
}  // namespace tricoil::host::web
