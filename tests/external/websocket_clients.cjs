// A page in headless Chromium and a Python program receive every pose of ten seconds by WebSocket, at the same time. A page of
// another origin is refused. The recipe of USE-FROM.md runs in the page.
//   node websocket_clients.cjs FOLDER_OF_NODE_MODULES TRICOIL PYTHON
const {execFile, spawn} = require('child_process');
const fs = require('fs');
const http = require('http');
const path = require('path');
const util = require('util');
const [modules, program, interpreter] = process.argv.slice(2);
const {chromium} = require(path.join(modules, 'node_modules', 'playwright-core'));

const RATE_HZ = 240;
const COUNT = 10 * RATE_HZ;
const RECIPES = path.join(__dirname, '../../board/host/serve/USE-FROM.md');

function check(condition, what) {
  if (!condition) throw new Error(what);
  console.log(`websocket_clients: ${what}`);
}

/// Server of an empty page; resolves with its port.
function servePage() {
  const server = http.createServer((request, response) => response.end('<!doctype html><title>empty</title>'));
  return new Promise(resolve => server.listen(0, '127.0.0.1', () => resolve({server, port: server.address().port})));
}

/// Starts the tracker; resolves with the address of its WebSocket server.
function serve(origin) {
  const child = spawn(program, ['serve', '--json', '--websocket', '0', '--scenario', 'hand', '--allow-origin', origin],
                      {stdio: ['ignore', 'pipe', 'inherit']});
  return new Promise((resolve, reject) => {
    child.once('exit', code => reject(new Error(`tricoil serve ended with ${code}`)));
    child.stdout.once('data', data => resolve({child, url: JSON.parse(data).websocket}));
  });
}

/// Runs in the page: sequence numbers and times of `count` poses.
function receive([url, count]) {
  return new Promise((resolve, reject) => {
    const seen = [];
    const socket = new WebSocket(url);
    socket.onerror = () => reject(new Error('the connection was refused'));
    socket.onmessage = event => {
      const pose = JSON.parse(event.data);
      if (!pose.flag_names.includes('stale')) seen.push([pose.sequence, pose.time_us]);
      if (seen.length === count) {
        socket.onclose = closed => closed.wasClean ? resolve(seen) : reject(new Error(`closed with code ${closed.code}`));
        socket.close();
      }
    };
  });
}

function expectAll(client, seen) {
  const lost = seen.slice(1).filter(([sequence], n) => sequence !== seen[n][0] + 1).length;
  const duration = 1e-6 * (seen[seen.length - 1][1] - seen[0][1]);
  check(seen.length === COUNT && lost === 0 && Math.abs(duration - (COUNT - 1) / RATE_HZ) < 1e-3,
        `${client}: ${seen.length} poses of ${duration.toFixed(2)} s, ${lost} gaps`);
}

async function main() {
  const {server, port} = await servePage();
  const tracker = await serve(`http://localhost:${port}`);
  const browser = await chromium.launch({executablePath: '/usr/bin/chromium', args: ['--no-sandbox', '--disable-gpu']});
  try {
    const page = await browser.newPage();
    await page.goto(`http://localhost:${port}/`);
    const python = util.promisify(execFile)(interpreter, [path.join(__dirname, 'websocket_client.py'), tracker.url, String(COUNT)]);
    const [inBrowser, inPython] = await Promise.all([page.evaluate(receive, [tracker.url, COUNT]), python]);
    expectAll('Chromium', inBrowser);
    expectAll('Python', JSON.parse(inPython.stdout));

    const [, recipe] = /^```js\n([^]*?)^```/m.exec(fs.readFileSync(RECIPES, 'utf8'));
    check(recipe.includes('ws://127.0.0.1:9000/'), 'USE-FROM.md has the recipe for browsers');
    await page.addScriptTag({content: recipe.replace('ws://127.0.0.1:9000/', tracker.url)});
    await page.waitForFunction(() => /^-?\d\.\d{4} -?\d\.\d{4} -?\d\.\d{4}$/.test(document.title), null, {timeout: 10000});
    check(true, `the recipe shows the position ${await page.title()}`);

    const stranger = await browser.newPage();
    await stranger.goto(`http://127.0.0.1:${port}/`);
    const refused = await stranger.evaluate(receive, [tracker.url, 1]).catch(error => error.message);
    check(/refused/.test(refused), 'a page of another origin is refused');
  } finally {
    await browser.close();
    server.close();
    tracker.child.removeAllListeners('exit');
    tracker.child.kill('SIGKILL');
  }
}

main().catch(error => { console.error(`websocket_clients: FAILED: ${error.message}`); process.exit(1); });
