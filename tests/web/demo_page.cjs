// The demo in a browser, from a plain server of files, in headless Chromium: its steps, speed and switch, without a server of tricoil.
//   node demo_page.cjs FOLDER_OF_NODE_MODULES FOLDER_OF_DEMO [FOLDER_FOR_SCREENSHOTS]
const {spawn} = require('child_process');
const fs = require('fs');
const os = require('os');
const path = require('path');
const {gzipSync} = require('zlib');
const [modules, site, pictures] = process.argv.slice(2);
const {chromium} = require(path.join(modules, 'node_modules', 'playwright-core'));

const kMostBytes = 1.5e6, kFirstPoseMs = 3000;
const kDrawing =
    ['--no-sandbox', '--use-gl=angle', '--use-angle=swiftshader', '--disable-gpu-rasterization', '--disable-accelerated-2d-canvas', '--disable-gpu-compositing'];

function check(condition, what) {
  if (!condition) throw new Error(what);
  console.log(`demo_page: ${what}`);
}

/// python3 -m http.server; resolves to its process and address.
function serve(folder) {
  const child = spawn('python3', ['-u', '-m', 'http.server', '--bind', '127.0.0.1', '--directory', folder, '0'], {stdio: ['ignore', 'pipe', 'ignore']});
  return new Promise((resolve, reject) => {
    child.once('exit', code => reject(new Error(`http.server ended with ${code}`)));
    child.stdout.once('data', data => resolve({child, url: `http://127.0.0.1:${/port (\d+)/.exec(data)[1]}/`}));
  });
}

async function openDemo(browser, url, options) {
  const page = await browser.newPage({viewport: {width: 1400, height: 900}, ...options});
  page.setDefaultTimeout(120000);
  const faults = [];
  page.on('pageerror', error => faults.push(String(error)));
  page.on('console', message => {
    if (['error', 'warning'].includes(message.type()) && !/WebGL|GPU/.test(message.text())) faults.push(message.text());
  });
  page.on('requestfailed', request => faults.push(`${request.url()}: ${request.failure().errorText}`));
  await page.goto(url);
  await page.waitForFunction(() => window.tricoil?.firstPoseMs);
  return {page, faults, text: id => page.textContent(id), wait: (condition, argument) => page.waitForFunction(condition, argument)};
}

const save = (page, name) => pictures ? page.screenshot({path: path.join(pictures, `${name}.png`)}) : null;
const error = (text, id) => text(`#error_${id}`).then(Number);
const hasBothErrors = () => ['with', 'without'].every(id => /\d/.test(document.getElementById(`error_${id}`).textContent));
/// Picture when both errors of a step are there.
async function shown({page, wait}, step, name) {
  await wait(n => window.tricoil.tour.place?.step === n, step);
  await wait(hasBothErrors);
  await save(page, name);
}

async function steps(demo) {
  const {page, text, wait} = demo;
  check(
      await page.locator('#tour_steps button').count() === 5 && /A simulated hand moves/.test(await text('#tour_text')) &&
          await text('#source') === 'simulation',
      `five steps, the first with its sentence: ${await text('#tour_text')}`);
  await wait(() => window.tricoil.firstPictureMs);
  await wait(() => window.tricoil.scene.sensors.get(0).truth.ghost.visible);
  await shown(demo, 0, 'demo-1');
  await page.keyboard.press('.');
  await shown(demo, 1, 'demo-2');
  check(await page.getAttribute('#without', 'aria-pressed') === 'true', 'a key leads to the step without motion compensation');
  check(
      await error(text, 'without') > 1 && await error(text, 'with') < 0.2 * await error(text, 'without'),
      `both errors are shown at once: ${await text('#error_without')} mm without, ${await text('#error_with')} mm with compensation`);
  const slow = await error(text, 'without');
  await page.locator('#hand_speed').focus();
  for (let n = 0; n < 4; ++n) await page.keyboard.press('ArrowRight');
  await wait(() => window.tricoil.tour.place.speed === 2);
  await wait(hasBothErrors);
  check(
      await error(text, 'without') > 1.5 * slow && await text('#hand_speed_value') === '×2',
      `a hand twice as fast: ${await text('#error_without')} mm without, ${await text('#error_with')} mm with compensation`);
  await save(page, 'demo-2-fast');
  await page.locator('body').press('x');
  await shown(demo, 2, 'demo-3');
  check(await page.getAttribute('#with', 'aria-pressed') === 'true', 'the switch leads to the step with motion compensation');
  await page.locator('body').press(']');
  await wait(() => window.tricoil.tour.place.speed === 2.25);
  await page.evaluate(() => document.querySelectorAll('#tour_steps button')[3].click());
  await shown(demo, 3, 'demo-4');
  check(await page.evaluate(() => window.tricoil.scene.metal.children.length) > 0, 'the metal is drawn');
  await page.click('#tour_next');
  await wait(() => window.tricoil.tour.place.step === 4);
  await wait(() => document.body.dataset.usable === 'false' && /sensor/i.test(document.querySelector('#reason').textContent));
  check(/no_sensor/.test(await text('#flags')) && !/no_sensor/.test(await text('#guide')), 'its flags are among the levels, the sentence is for people');
  await save(page, 'demo-5');
  await wait(() => document.body.dataset.usable === 'true');
  check(true, 'the unplugged sensor is lost, and comes back');
}

async function controls({page, text, wait}) {
  await page.keyboard.press(' ');
  await page.click('#stop_yes');
  await wait(() => !window.tricoil.status.running && document.body.dataset.link === 'silent');
  await page.locator('body').press(' ');
  await wait(() => window.tricoil.status.running && document.body.dataset.link === 'live');
  check(true, 'the coils stop and start');
  await page.keyboard.press('t');
  await wait(() => /none yet/.test(document.querySelector('#tools').textContent));
  await page.keyboard.press('r');
  await page.fill('#record_name', 'x');
  await page.keyboard.press('Enter');
  await wait(() => /not in this demo/.test(document.querySelector('#answer').textContent));
  check(true, `a recording is refused: ${await text('#answer')}`);
}

/// Without its program the page says so, and loads it as soon as it is there.
async function withoutProgram(browser, url) {
  const page = await browser.newPage();
  page.setDefaultTimeout(120000);
  await page.route('**/demo.wasm', route => route.fulfill({status: 404}));
  await page.goto(url);
  await page.waitForFunction(() => /cannot be loaded/.test(document.querySelector('#problem').textContent) && document.body.dataset.link === 'down');
  check(true, `without its program: ${await page.textContent('#problem')}`);
  await page.unroute('**/demo.wasm');
  await page.waitForFunction(() => window.tricoil.firstPoseMs && document.querySelector('#problem').textContent === '');
  check(true, 'the page goes on when the program is there');
  await page.close();
}

/// Runs in the page before its script: a serial port that plays what a simulated front end sent (board.bin), at its pace, and keeps what the
/// page sends.
function standIn(base64) {
  const bytes = Uint8Array.from(atob(base64), sign => sign.charCodeAt(0));
  const port = window.standIn = {sent: 0, messages: 0};
  const kAnswers = [2, 1, 1];  // messages of the device after each of the first messages of the page
  const kChunk = 1024, kPace_ms = 20;
  const wait = ms => new Promise(done => setTimeout(done, ms));
  let control = null, at = 0;
  port.open = async () => {};
  port.readable = new ReadableStream({
    start(given) {
      control = given;
    }
  });
  const play = async () => {
    for (; at < bytes.length; at += kChunk) {
      control.enqueue(bytes.slice(at, at + kChunk));
      await wait(kPace_ms);
    }
    while (!port.ends) await wait(kPace_ms);
    control.close();
  };
  // At once, so that the page does not ask again.
  const answer = messages => {
    for (let n = 0; n < messages; ++n) {
      const end = bytes.indexOf(0, at) + 1;
      control.enqueue(bytes.slice(at, end));
      at = end;
    }
  };
  port.writable = new WritableStream({
    write(chunk) {
      port.sent += chunk.length;
      for (const byte of chunk) {
        if (byte !== 0 || ++port.messages > kAnswers.length) continue;
        answer(kAnswers[port.messages - 1]);
        if (port.messages === kAnswers.length) play();
      }
    }
  });
  Object.defineProperty(navigator, 'serial', {value: {requestPort: async () => port.refuses ? Promise.reject(new Error('No port selected')) : port}});
}

/// The page reads a board by Web Serial, from recorded bytes.
async function readBoard(browser, url) {
  const context = await browser.newContext();
  const bytes = fs.readFileSync(path.join(__dirname, 'board.bin')).toString('base64');
  await context.addInitScript(standIn, bytes);
  const demo = await openDemo(context, url);
  const {page, text, wait, faults} = demo;
  await wait(() => document.getElementById('read_board'));
  check(/not yet with hardware/.test(await page.getAttribute('#read_board', 'title')), 'the page says that hardware is untested');
  await page.evaluate(() => {
    window.standIn.refuses = true;
  });
  await page.click('#read_board');
  await wait(() => /No board: No port selected/.test(document.querySelector('#answer').textContent));
  check(await page.evaluate(() => window.tricoil.tour.place !== null), 'without a port the simulation goes on');
  await page.evaluate(() => {
    window.standIn.refuses = false;
  });
  await page.click('#read_board');
  await wait(() => window.tricoil.status.health?.firmware === '0.1.0' && window.tricoil.tour.place === null);
  check(/not yet tested with hardware/.test(await text('#source')), `a board is read, and the page says what is untested: ${await text('#source')}`);
  await wait(() => window.tricoil.newest.valid && window.tricoil.newest.truth === null);
  const {position_m, truth} = await page.evaluate(() => window.tricoil.newest);
  const range = Math.hypot(...position_m);
  check(
      range > 0.2 && range < 1.5 && truth === null,
      `its couplings give poses: ${position_m.map(v => v.toFixed(3)).join(' ')} m, without a truth`);
  await save(page, 'board');
  await page.selectOption('#hemisphere', '-1,0,0');
  await page.click('#set');
  await wait(() => /hemisphere set/.test(document.querySelector('#answer').textContent));
  await page.evaluate(() => {
    window.standIn.ends = true;
  });
  await wait(() => /The board was lost: the port was closed/.test(document.querySelector('#problem').textContent));
  check(await page.evaluate(() => window.standIn.sent > 40), `a lost board is told: ${await text('#problem')}`);
  check(faults.length === 0, `no faults in the page ${faults.join('; ')}`);
  await context.close();
}

async function main() {
  const size = ['index.html', 'demo.js', 'demo.wasm'].reduce((sum, name) => sum + gzipSync(fs.readFileSync(path.join(site, name))).length, 0);
  check(size < kMostBytes, `the demo has ${size} bytes, compressed`);
  const [root, below] = await Promise.all([serve(site), serve(path.dirname(path.resolve(site)))]);
  const browser = await chromium.launch({executablePath: '/usr/bin/chromium', args: kDrawing});
  try {
    const times = [];
    for (let n = 0; n < 3; ++n) {
      const {page, faults} = await openDemo(browser, root.url);
      times.push(Math.round(await page.evaluate(() => window.tricoil.firstPoseMs)));
      check(faults.length === 0, `no faults while the page loads ${faults.join('; ')}`);
      await page.close();
    }
    // A busy machine is slower in proportion.
    const load = os.loadavg()[0] / os.cpus().length;
    check(Math.min(...times) < kFirstPoseMs * Math.max(1, load), `first pose after ${times.join(', ')} ms (load ${load.toFixed(1)} a processor)`);
    const demo = await openDemo(browser, root.url);
    await steps(demo);
    await controls(demo);
    check(demo.faults.length === 0, `no faults in the page ${demo.faults.join('; ')}`);
    await demo.page.close();

    await readBoard(browser, root.url);
    await withoutProgram(browser, root.url);
    const linked = await openDemo(browser, `${below.url}${path.basename(path.resolve(site))}/#step=3&speed=1.5&noise=no`);
    check(
        await linked.page.evaluate(() => window.tricoil.tour.place.step === 2 && window.tricoil.tour.place.speed === 1.5),
        'below a path, and with a link to a step');
    await linked.page.close();
    const looks = [['phone', {viewport: {width: 390, height: 844}, isMobile: true, hasTouch: true, deviceScaleFactor: 2}], ['dark', {colorScheme: 'dark'}]];
    for (const [name, options] of looks) {
      const other = await openDemo(browser, `${root.url}#step=2&speed=2`, options);
      await other.wait(() => window.tricoil.firstPictureMs);
      await shown(other, 1, `demo-${name}`);
      check(
          await other.page.evaluate(() => document.documentElement.scrollWidth <= innerWidth) && other.faults.length === 0,
          `${name}: fits, without faults ${other.faults.join('; ')}`);
      await other.page.close();
    }
  } finally {
    await browser.close();
    for (const {child} of [root, below]) {
      child.removeAllListeners('exit');
      child.kill('SIGKILL');
    }
  }
}

main().catch(error => {
  console.error(`demo_page: FAILED: ${error.stack}`);
  process.exit(1);
});
