// The live page in headless Chromium, in parts. Part `server`: with `tricoil serve` it connects, shows motion, sends commands, and reconnects
// after a restart; foreign origins are refused. The other parts are the files page_*.cjs.
//   node web_page.cjs FOLDER_OF_NODE_MODULES PART|all TRICOIL [FOLDER_FOR_SCREENSHOTS]
const fs = require('fs');
const http = require('http');
const os = require('os');
const path = require('path');
const {gzipSync} = require('zlib');
const {serve} = require('./page_check.cjs');
const kParts = ['states', 'tour', 'view', 'plots', 'layout', 'work', 'access', 'trouble', 'setup'];
const [modules, chosen, program, pictures] = process.argv.slice(2);
const {chromium} = require(path.join(modules, 'node_modules', 'playwright-core'));

function check(condition, what) {
  if (!condition) throw new Error(what);
  console.log(`web_page: ${what}`);
}

/// A sensor on a circle.
const serveCircle = (port, folder) => serve(program, port, ['--scenario', 'circle', '--record-folder', folder]);

function request(url, options, body) {
  return new Promise((resolve, reject) => {
    const sent = http.request(url, options, response => {
      let text = '';
      response.on('data', data => {
        text += data;
      });
      response.on('end', () => resolve({status: response.statusCode, text}));
    });
    sent.on('error', reject);
    sent.end(body);
  });
}

async function refuseStrangers(url, controls) {
  const {host} = new URL(url);
  const command = JSON.stringify({run: false});
  const bearer = {Authorization: `Bearer ${new URLSearchParams(new URL(controls).hash.slice(1)).get('token')}`};
  const json = {'Content-Type': 'application/json', ...bearer};
  check(
      (await request(url + 'control', {method: 'POST', headers: {'Content-Type': 'application/json'}}, command)).status === 401,
      'a control request without the token is refused');
  const post = headers => request(url + 'control', {method: 'POST', headers}, command);
  check((await post({...json, Origin: 'http://evil.example'})).status === 403, 'a control request from another page is refused');
  check((await post({...json, Origin: 'null'})).status === 403, 'a control request from a page without an origin is refused');
  check((await post({...json, Host: 'evil.example'})).status === 403, 'a control request with another host name is refused');
  check((await post({...bearer, 'Content-Type': 'text/plain'})).status === 415, 'a control request that is not JSON is refused');
  check((await request(url, {headers: {Host: 'evil.example:80'}})).status === 403, 'a page request with another host name is refused');
  check((await request(url + 'stream', {headers: {Origin: 'http://evil.example'}})).status === 403, 'the stream for another page is refused');
  for (const bad
           of ['', '{', '[]', '{"hemisphere":[1,2]}', '{"hemisphere":[1,2,"x"]}', '{"hemisphere":[1,0,0],"sensor":9}', '{"run":1}',
               '{"record":true,"name":3}'])
    check((await request(url + 'control', {method: 'POST', headers: json}, bad)).status === 400, `'${bad}' is not a valid control request`);
  check(
      (await request(url + 'control', {method: 'POST', headers: json}, 'x'.repeat(5000))).status === 413,
      'a control request that is too long is refused');
  check(
      (await request(url + 'control', {method: 'POST', headers: {...json, Origin: `http://${host}`}}, '{"run":true}')).status === 200,
      'a control request from our own page is accepted');
}

/// Records under a name, and plays the recording.
async function recordAndPlay(page, server, folder) {
  const answers = pattern => page.waitForFunction(source => new RegExp(source).test(document.querySelector('#answer').textContent), pattern.source);
  const start = async name => {
    await page.click('#record');
    await page.fill('#record_name', name);
    await page.keyboard.press('Enter');
  };
  await start('../take');
  await answers(/must not begin with a dot/);
  await start('take 1');
  await page.waitForFunction(() => window.tricoil.status.recording && window.tricoil.status.recording_bytes > 20000);
  check(
      /^● take 1 0:0\d, \d\.\d MB$/.test(await page.textContent('#recording')),
      `the recording shows its name and size: ${await page.textContent('#recording')}`);
  await page.click('#record');
  await answers(/recorded/);  // the answer comes after the recording is complete, the status before
  await page.waitForFunction(() => !window.tricoil.status.recording);
  check(
      JSON.parse(fs.readFileSync(path.join(folder, 'take 1', 'recording.json'))).complete && fs.readdirSync(folder).length === 1,
      'it is complete, and the only one');
  await start('take 1');
  await answers(/take 1 exists; choose another name/);
  await page.keyboard.press('t');
  await page.getByRole('button', {name: 'Play'}).first().click();
  await page.waitForFunction(() => window.tricoil.playback?.t > 0);
  const poses = await page.evaluate(() => window.tricoil.playback.sensors.get(0).poses.length);
  const recorded = fs.readFileSync(path.join(folder, 'take 1', 'poses.csv'), 'utf8').trim().split('\n').length - 1;
  check(poses === recorded, `every recorded pose is played: ${poses}`);
  check(
      await page.evaluate(() => [...window.tricoil.playback.sensors.values()].every(({poses}) => poses.every(({truth}) => truth))),
      'with their true poses');
  await page.keyboard.press('Escape');
  await page.keyboard.press('t');
  check(
      (await request(server.web + 'recordings', {})).status === 401 && (await request(server.web + 'recordings/take%201', {})).status === 401,
      'recordings need the token');
  const bearer = {headers: {Authorization: `Bearer ${new URLSearchParams(new URL(server.web_controls).hash.slice(1)).get('token')}`}};
  for (const bad of ['%2e%2e%2f', '.hidden', 'none', 'take%201%2fposes.csv'])
    check((await request(`${server.web}recordings/${bad}`, bearer)).status === 422, `there is no recording '${bad}'`);
  fs.appendFileSync(path.join(folder, 'take 1', 'poses.csv'), '1,2,3\n');
  const changed = await request(`${server.web}recordings/take%201`, bearer);
  check(changed.status === 422 && /"take 1\/poses.csv: was changed/.test(changed.text), `a changed recording is refused: ${changed.text}`);
}

// The picture is rendered in software: on a busy machine each step may take long.
async function newPage(browser, options) {
  const page = await browser.newPage(options);
  page.setDefaultTimeout(120000);
  return page;
}

async function withoutWebGl(url) {
  const browser = await chromium.launch({executablePath: '/usr/bin/chromium', args: ['--no-sandbox', '--disable-gpu', '--disable-3d-apis']});
  try {
    const page = await newPage(browser);
    await page.goto(url);
    await page.waitForFunction(() => window.tricoil?.poses > 60);
    const note = await page.textContent('#ellipsoid');
    check(/does not support WebGL/.test(note) && /^[−\d.]+$/.test(await page.textContent('#p0')), 'without WebGL numbers and plots continue');
    if (pictures) await page.screenshot({path: path.join(pictures, 'no-webgl.png')});
  } finally {
    await browser.close();
  }
}

/// The page with `tricoil serve`.
async function pageServer(browser, html) {
  const folder = fs.mkdtempSync(path.join(os.tmpdir(), 'tricoil_web_'));
  let server = await serveCircle(0, folder);
  const port = Number(new URL(server.web).port);
  try {
    const size = Buffer.byteLength(html);
    check(size < 1e6 && gzipSync(html).length < 1e6 / 4, `the page has ${size} bytes, compressed ${gzipSync(html).length}`);
    await refuseStrangers(server.web, server.web_controls);

    const page = await newPage(browser, {viewport: {width: 1280, height: 800}});
    const errors = [];
    page.on('pageerror', error => errors.push(String(error)));
    page.on('console', message => {
      if (message.type() === 'error') errors.push(message.text());
    });
    await page.goto('data:text/html,<h1>The browser itself has begun</h1>');
    await page.screenshot();
    const firsts = [];
    for (let n = 0; n < 3; ++n) {
      await page.goto(n === 0 ? server.web_controls : server.web);  // the tab keeps the token
      await page.waitForFunction(() => window.tricoil?.firstPoseMs && window.tricoil.firstPictureMs);
      firsts.push(await page.evaluate(() => [window.tricoil.firstPoseMs, window.tricoil.firstPictureMs]));
    }
    // Depends on the wall clock, so printed but not checked; here the 3D view is rendered in software.
    console.log(
        `web_page: first pose drawn after ${firsts.map(first => Math.round(first[0])).join(', ')} ms, 3D view after ` +
        `${firsts.map(first => Math.round(first[1])).join(', ')} ms (load ${os.loadavg()[0].toFixed(1)})`);
    check(firsts.every(([pose, picture]) => pose < picture), 'the first pose does not wait for the 3D view');

    const position = () => page.evaluate(() => window.tricoil.newest.position_m);
    const moved = async () => {
      const before = await position();
      await page.waitForFunction(p => Math.hypot(...window.tricoil.newest.position_m.map((v, n) => v - p[n])) > 0.02, before);
    };
    await moved();
    check(await page.evaluate(() => document.body.dataset.link) === 'live', 'the page is live, and the sensor moves');
    await page.waitForFunction(() => window.tricoil.poses > 60);
    if (pictures) await page.screenshot({path: path.join(pictures, 'desktop.png')});

    check(!page.url().includes('token'), 'the token is not in the address bar');
    await page.waitForFunction(() => document.body.dataset.usable === 'true');
    await page.keyboard.press('b');
    await page.waitForFunction(() => window.tricoil.boresight);
    await page.keyboard.press('u');
    check(await page.evaluate(() => window.tricoil.boresight) === null, 'keys set and clear the boresight');
    await page.click('#run');
    await page.click('#stop_yes');
    await page.waitForFunction(() => !window.tricoil.status.running);
    check(
        await page.textContent('#run') === 'Start' && /Coils are off/.test(await page.textContent('#reason')),
        'the button asks, and then stops the tracker');
    await page.waitForFunction(() => document.body.dataset.link === 'silent');
    await page.waitForFunction(() => window.tricoil.newest.names.includes('stale') && document.querySelector('#state').textContent === '');
    check(await page.evaluate(() => document.body.dataset.usable === 'false'), 'after a stop the last pose is stale, and no state is shown');
    await page.locator('body').press(' ');
    await page.waitForFunction(() => window.tricoil.status.running);
    await moved();
    check(true, 'the key starts the tracker, and the sensor moves again');
    await page.selectOption('#hemisphere', '-1,0,0');
    await page.click('#set');
    await page.waitForFunction(() => window.tricoil.newest.position_m[0] < 0);
    check(true, 'the hemisphere was set');
    await recordAndPlay(page, server, folder);

    server.end();
    await page.waitForFunction(() => document.body.dataset.link === 'down');
    server = await serveCircle(port, folder);
    await page.waitForFunction(() => document.body.dataset.link === 'live');
    await moved();
    check(true, 'the page reconnects after a restart of the server');
    const own = errors.filter(text => !/ERR_CONNECTION|ERR_INCOMPLETE|ERR_EMPTY|Failed to load resource/.test(text));
    check(own.length === 0, `no errors in the page ${own.join('; ')}`);

    const phone = await newPage(browser, {viewport: {width: 390, height: 800}, isMobile: true, hasTouch: true, deviceScaleFactor: 2});
    await phone.goto(server.web);
    await phone.waitForFunction(() => window.tricoil?.poses > 60);
    check(await phone.isDisabled('#run') && /read only/.test(await phone.textContent('#access')), 'without the controls link it is read only');
    check(await phone.evaluate(() => document.documentElement.scrollWidth <= innerWidth), 'the page fits the screen of a phone');
    if (pictures) await phone.screenshot({path: path.join(pictures, 'phone.png')});
    for (const open of [page, phone]) await open.close();  // their drawing would slow down the others
    await withoutWebGl(server.web);
  } finally {
    server.end();
    fs.rmSync(folder, {recursive: true, force: true});
  }
}

/// The page as `tricoil serve` sends it.
async function pageOf() {
  const server = await serveCircle(0, os.tmpdir());
  const {text} = await request(server.web, {});
  server.end();
  return text;
}

async function main() {
  const parts = {server: pageServer, ...Object.fromEntries(kParts.map(name => [name, require(`./page_${name}.cjs`)]))};
  if (chosen !== 'all' && !parts[chosen]) throw new Error(`there is no part '${chosen}'; there are ${Object.keys(parts).join(', ')} and all`);
  const html = await pageOf();
  // Only the 3D view is drawn as by a graphics processor: emulating it for the rest of the page, as Chromium would, takes longer.
  const drawing =
      ['--use-gl=angle', '--use-angle=swiftshader', '--disable-gpu-rasterization', '--disable-accelerated-2d-canvas', '--disable-gpu-compositing'];
  const browser = await chromium.launch({executablePath: '/usr/bin/chromium', args: ['--no-sandbox', ...drawing]});
  try {
    for (const part of chosen === 'all' ? Object.values(parts) : [parts[chosen]]) await part(browser, html, check, pictures, program);
  } finally {
    await browser.close();
  }
}

main().catch(error => {
  console.error(`web_page: FAILED: ${error.stack}`);
  process.exit(1);
});
