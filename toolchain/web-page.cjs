// Inserts script and styles into the page, and the page into a C++ source, as a byte array because string literals have a length limit.
//   node web-page.cjs FOLDER_OF_PAGE BUNDLE.js FOLDER_OF_NODE_MODULES OUT.cpp
const fs = require('fs');
const path = require('path');
const [page, bundle, modules, out] = process.argv.slice(2);
const kMaxBytes = 1e6;

const style = fs.readFileSync(path.join(modules, 'node_modules/uplot/dist/uPlot.min.css'), 'utf8') +
              fs.readFileSync(path.join(page, 'style.css'), 'utf8');
const script = fs.readFileSync(bundle, 'utf8').replaceAll('</script', '<\\/script');
const html = fs.readFileSync(path.join(page, 'index.html'), 'utf8')
  .replace('/*STYLE*/', () => style).replace('/*SCRIPT*/', () => script);
const bytes = Buffer.from(html);
if (bytes.length >= kMaxBytes) {
  console.error(`web-page: ${bytes.length} bytes; the page must stay under ${kMaxBytes}`);
  process.exit(1);
}
const rows = [];
for (let at = 0; at < bytes.length; at += 32) rows.push([...bytes.subarray(at, at + 32)].join(','));
fs.writeFileSync(out, `#include "board/host/serve/web/page_text.hpp"

namespace tricoil::host::web {
namespace {
constexpr unsigned char kBytes[] = {
${rows.join(',\n')}};
}  // namespace
const std::string_view kPage(reinterpret_cast<const char*>(kBytes), sizeof kBytes);
}  // namespace tricoil::host::web
`);
