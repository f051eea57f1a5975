// Work with the live page: points, distances, pivot, playback of recordings, damaged ones among them.
const {openPage, save, text} = require('./page_check.cjs');
const {sample} = require('./scripted_server.cjs');

const kTip_m = [0.12, -0.01, 0.02];
const kPoint_m = [0.5, 0.1, 0.05];

const product =
    ([a, b, c, d],
     [e, f, g, h]) => [a * e - b * f - c * g - d * h, a * f + b * e + c * h - d * g, a * g - b * h + c * e + d * f, a * h + b * g - c * f + d * e];
const rotated = (q, v) => product(product(q, [0, ...v]), [q[0], -q[1], -q[2], -q[3]]).slice(1);

/// Pose of a pointer whose tip rests at kPoint_m.
function pointer(t, tilt) {
  const half = tilt / 2, about = t / 400;
  const q = product(
      [Math.cos(half), Math.sin(half) * Math.cos(about), Math.sin(half) * Math.sin(about), 0], [Math.cos(about / 3), 0, 0, Math.sin(about / 3)]);
  const tip = rotated(q, kTip_m);
  return sample(0, 1.7e12 + t, kPoint_m.map((v, n) => v - tip[n]), {q});
}

async function points(page, server, wait, check) {
  let t = 1.7e12;
  let place = [0.4, 0, 0.1];
  let speed = 0;
  let more = {};
  const ticker = setInterval(() => {
    for (let n = 0; n < 12; ++n, t += 1000 / 240, place[0] += speed / 240) server.send([sample(0, t, place, more)]);
  }, 50);
  /// Until the last second has nothing else than these poses.
  const settle = async () => {
    const before = await page.evaluate(() => window.tricoil.poses);
    await wait(count => window.tricoil.poses > count, before + 300);
  };
  const rows = () => page.$$eval('#points tbody tr', all => all.map(row => [...row.cells].map(cell => cell.textContent)));
  await wait(() => window.tricoil.firstPictureMs);
  await settle();
  await page.keyboard.press('t');
  await page.keyboard.press('v');
  place = [0.4, 0.3, 0.5];
  await settle();
  await page.keyboard.press('c');
  check(
      (await rows()).length === 2 && (await rows())[1][5] === '500.00',
      `two points, and their distance: ${(await rows())[1].slice(1, 6).join(' ')} mm`);
  speed = 0.2;
  await settle();
  await page.keyboard.press('v');
  check(
      /The sensor moved by \d+ mm RMS/.test(await text(page, '#answer')) && (await rows()).length === 2,
      `an average of a moving sensor is refused: ${await text(page, '#answer')}`);
  more = {flags: ['no_sensor']};
  await wait(() => document.body.dataset.usable === 'false');
  await page.keyboard.press('c');
  check(/No valid pose/.test(await text(page, '#answer')) && (await rows()).length === 2, 'an invalid pose is not captured');
  clearInterval(ticker);
}

async function pivot(browser, html, check) {
  const {server, page, wait, close} = await openPage(browser, html);
  server.send([pointer(0, 0.6)]);
  await wait(() => window.tricoil.firstPictureMs);
  await page.keyboard.press('t');
  const run = async tilt => {
    await page.click('#pivot');
    const before = await page.evaluate(() => window.tricoil.poses);
    for (let n = 1; n <= 600; ++n) server.send([pointer((before + n) * 10, tilt)]);
    await wait(count => window.tricoil.poses === count, before + 600);
    await page.click('#pivot');
    return text(page, '#pivot_result');
  };
  const found = await run(0.6);
  check(/120\.00, -10\.00, 20\.00 mm/.test(found) && /--tip 0\.120000,-0\.010000,0\.020000/.test(found), `the pivot finds the tip: ${found}`);
  check(/Too little tilt/.test(await run(0.02)), 'a pivot with too little tilt is refused');
  await close();
}

function recording(count, more = () => ({}), shift = () => 0) {
  const lines = ['{"name":"take","started":"","complete":true}'];
  for (let n = 0; n < count; ++n) lines.push(JSON.stringify(sample(0, shift(n) + n * 1000 / 240, [0.4 + n / 1e5, 0, 0.1], more(n))));
  return lines.join('\n') + '\n';
}

const kYear_ms = 365 * 24 * 3600e3;
const kCsv =
    'sensor,time_us,flags,x_m,y_m,z_m,qw,qx,qy,qz,std_x_m,std_y_m,std_z_m,distortion_mm,snr_db\n0,0,0,0.4,0,0.1,1,0,0,0,0.001,0.001,0.001,0.1,60\n0,4000,0,0.4,0,0.1,1,0,0,0,0.001,0.001,0.001,0.1,60\n0,8000,0,0.4,0,0';

async function playback(browser, html, check, pictures) {
  const whole = recording(2400, n => n > 1000 && n < 1300 ? {flags: ['distorted'], distortion: 5} : {});
  const recordings = {
    good: whole,
    cut: whole.slice(0, whole.length / 2),
    noise: '\u0000\u0001 not a recording',
    empty: '',
    restarted: recording(300) + recording(300),
    jumped: recording(600, n => n === 0 ? {flags: ['no_sensor']} : {}, n => n > 0 ? kYear_ms : 0),
    late: recording(100) + '{"error":"late/poses.csv:101: has 3 fields instead of 47"}\n',
    changed: {status: 422, answer: 'changed/poses.csv: was changed since it was recorded (size or CRC differ from recording.json)'},
  };
  const {server, page, errors, wait, close} = await openPage(browser, html, {recordings});
  server.send([sample(0, 1.7e12, [0.4, 0, 0.1])]);
  await wait(() => window.tricoil.firstPictureMs);
  await page.keyboard.press('t');
  const play = name => page.locator('tr', {has: page.getByRole('cell', {name, exact: true})}).getByRole('button', {name: 'Play'}).click();
  const says = (pattern, what) => wait(source => new RegExp(source).test(document.querySelector('#answer').textContent), pattern.source)
                                      .then(async () => check(true, `${what}: ${await text(page, '#answer')}`));
  for (const [name, pattern] of [
           ['noise', /columns sensor, time_us.* are missing/], ['empty', /The file is empty/], ['changed', /was changed since it was recorded/]]) {
    await play(name);
    await says(pattern, `a recording that is ${name} is refused`);
    check(await page.evaluate(() => window.tricoil.playback === null), 'the page stays live');
  }
  for (const [name, pattern] of [['cut', /1 damaged line was left out/], ['late', /has 3 fields/]]) {
    await play(name);
    await says(pattern, `a recording that is damaged (${name}) is played as far as it goes`);
    check(await page.evaluate(() => window.tricoil.playback.to > 0.4), 'its poses are shown');
    await page.keyboard.press('Escape');
    check(await page.evaluate(() => window.tricoil.playback === null && document.body.dataset.mode === 'live'), 'a key leads back to live');
  }
  await play('restarted');
  await wait(() => window.tricoil.playback?.name === 'restarted');
  check(
      await page.evaluate(() => window.tricoil.playback.sensors.get(0).poses.length === 600 && window.tricoil.playback.to > 3),
      'after a restart of the device a recording goes on');
  await page.keyboard.press('Escape');
  await play('jumped');
  await wait(() => window.tricoil.playback?.name === 'jumped');
  await page.locator('#position').fill(String(kYear_ms / 1000 + 1));
  await page.waitForTimeout(500);
  check(
      await page.evaluate(() => window.tricoil.playback.sensors.get(0).newest.valid),
      'a recording whose first time is a year before the others does not stop the page');
  await page.keyboard.press('Escape');
  await page.setInputFiles('#file', {name: 'poses.csv', mimeType: 'text/csv', buffer: Buffer.from(kCsv)});
  await says(/1 damaged line was left out/, 'a CSV file with a cut line is played');
  await page.keyboard.press('Escape');
  await play('good');
  await wait(() => window.tricoil.playback?.t > 0.3);
  await page.locator('#position').fill('5');
  await page.keyboard.press(' ');
  await wait(() => window.tricoil.playback.t >= 5 && !window.tricoil.playback.playing);
  await wait(() => document.body.dataset.quality === 'caution');
  check(
      /Metal/.test(await text(page, '#reason')) && /^0:05\.\d \/ 0:10\.0$/.test(await text(page, '#play_time')),
      `the time line jumps: ${await text(page, '#play_time')}, ${await text(page, '#reason')}`);
  check(server.asked.length === 0, 'in playback the space key plays and pauses, and asks the server for nothing');
  await page.keyboard.press('t');
  await page.waitForTimeout(300);
  await save(page, pictures, 'playback');
  server.send([sample(0, 1.7e12 + 40, [0.6, 0, 0.1])]);
  await page.waitForTimeout(200);
  check(await page.evaluate(() => window.tricoil.newest.position_m[0] < 0.5), 'live poses do not disturb the playback');
  await page.click('#leave');
  await wait(() => document.querySelector('#p0').textContent === '600.0');
  check(errors.length === 0, `no errors in the page ${errors.join('; ')}`);
  await close();
}

/// Levels of source coil `coil`, as a server sends them.
const levelRow = (sensor, coil, more = {}) => ({
  sensor, coil, columns: 240, gain_step: 3, saturated: 0, without_reference: 0, coupling: [0.0123, -0.5, 0], level: [0.25, 0.5, 0],
  noise: [1.9e-5, 1.9e-5, null], snr_db: [56.2, 88.4, null], ...more
});

async function levels(browser, html, check, pictures) {
  const {server, page, errors, wait, close} = await openPage(browser, html);
  const send = (rows, status = {}) => server.send([sample(0, Date.now(), [0.4, 0, 0.1])], {levels: rows, ...status});
  const cells = () => page.$$eval('#levels tbody tr', all => all.map(row => [...row.cells].map(cell => cell.textContent).join(' ')));
  send([1, 2, 3].map(coil => levelRow(0, coil)));
  await page.keyboard.press('l');
  await wait(() => document.querySelectorAll('#levels tbody tr').length === 12);
  check(await page.evaluate(() => document.activeElement.textContent === 'Levels'), 'a key leads to the levels');
  const shown = await cells();
  check(
      shown[0] === 'S1: gain step 3, not saturated, reference current found' && shown[1] === '1 1.230e−2 25.0 % 1.9e−5 56.2 dB' &&
          shown[3] === '3 0.000e+0 – – –',
      `they are those of the device: ${shown[0]}; ${shown[1]}; ${shown[3]}`);
  const small = await page.$$eval('#levels *', all => all.filter(part => parseFloat(getComputedStyle(part).fontSize) < 12).length);
  check(small === 0, 'their text has at least 12 px');
  await save(page, pictures, 'levels');
  send([levelRow(0, 2, {saturated: 7, without_reference: 240}), levelRow(1, 1)]);
  await wait(() => document.querySelectorAll('#levels tbody tr').length === 4);
  check(
      (await cells())[0] === 'S2: gain step 3, ▲ saturated 7 of 240, ▲ no reference current in 240 of 240',
      `of the chosen sensor, with its faults: ${(await cells())[0]}`);
  send([]);
  await wait(() => /No columns/.test(document.querySelector('#levels p').textContent));
  await page.keyboard.press('l');
  check(await page.isHidden('#tools'), 'the key closes them');
  check(errors.length === 0, `no errors in the page ${errors.join('; ')}`);
  await close();
}

module.exports = async function pageWork(browser, html, check, pictures) {
  const {server, page, errors, wait, close} = await openPage(browser, html);
  await points(page, server, wait, check);
  check(errors.length === 0, `no errors in the page ${errors.join('; ')}`);
  await close();
  await levels(browser, html, check, pictures);
  await pivot(browser, html, check);
  await playback(browser, html, check, pictures);
};
