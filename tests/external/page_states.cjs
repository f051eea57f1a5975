// The live page with generated poses: several sensors, a silent sensor, gaps, faults, and the help that it gives.
const {changeOfScene, openPage, save, settledScene, text} = require('./page_check.cjs');
const {healthy, sample} = require('./scripted_server.cjs');

const kFrame_ms = 33;

async function twoSensors(browser, html, check, pictures) {
  const {server, page, errors, wait, close} = await openPage(browser, html);
  let now = 1.7e12;
  /// Sends `count` events, one frame apart, with poses of both sensors. The pose of the second sensor is slightly older.
  let status = {};
  const both = (count, more = {}) => {
    for (let n = 0; n < count; ++n, now += kFrame_ms)
      server.send([sample(0, now, [0.4 + n / 400, 0, 0.1], more), sample(1, now - 4, [0.7 - n / 400, 0.1, 0.1], more)], status);
  };
  both(1);
  await wait(() => window.tricoil.firstPictureMs);
  both(60);
  await wait(() => window.tricoil.poses === 122);
  const lengths = await page.evaluate(() => [...window.tricoil.sensors.values()].map(sensor => sensor.history.length));
  check(lengths.every(length => length >= 60), `each of two sensors keeps its own plots: ${lengths} poses`);
  const fastest = await page.evaluate(() => {
    const {length, columns} = window.tricoil.sensors.get(0).history;
    return Math.max(...columns.speed.subarray(0, length).filter(Number.isFinite));
  });
  check(fastest < 1, `no sensor jumps to the position of another: ${fastest.toFixed(2)} m/s at most`);
  check(await page.isVisible('#sensor') && await text(page, '#p1') === '0.0', 'the numbers are the first sensor\'s');
  const ticker = setInterval(() => both(1), 100);  // keeps the stream alive
  await wait(() => document.body.dataset.usable === 'true');
  await page.keyboard.press('b');
  check(
      /Boresight of sensor 1: on this page only/.test(await text(page, '#answer')) && await page.isVisible('#relative'),
      'a boresight says whom it affects');
  await page.selectOption('#sensor', {value: '1'});
  await wait(() => document.querySelector('#p1').textContent === '100.0');
  check(
      await page.evaluate(() => window.tricoil.boresight === null && window.tricoil.sensors.get(0).boresight !== null),
      'the second sensor can be chosen, and has its own boresight');
  await wait(() => document.body.dataset.link === 'live' && document.body.dataset.quality === 'good');
  await save(page, pictures, 'two-sensors');
  check(/ellipsoid: 3 × expected error, drawn x\d+/.test(await text(page, '#ellipsoid')), `the ellipsoid tells its scale: ${await text(page, '#ellipsoid')}`);
  // The colours of a trail change with its age. A busy machine draws the scene without trails only with later poses.
  const cleared = await page.evaluate(() => {
    window.tricoil.scene.sensors.forEach(view => view.trail.clear());
    return window.tricoil.poses;
  });
  await wait(count => window.tricoil.poses >= count + 10, cleared);
  await page.click('#follow');  // the camera stays
  const drawn = await settledScene(page);
  status = {confined_to: [[1, 0, 0], [1, 0, 0]]};
  await wait(() => window.tricoil.status.confined_to.length === 2);
  const boundary = await changeOfScene(page, drawn, changed => changed > 5000);
  check(boundary > 5000, `the boundary of the half space of a confined sensor is drawn: ${boundary} pixels`);
  await save(page, pictures, 'confined');
  status = {};
  await wait(() => window.tricoil.status.confined_to.length === 0);
  const unbounded = await changeOfScene(page, drawn, changed => changed < boundary / 10);
  check(unbounded < boundary / 10, `without a confined sensor there is no boundary: ${unbounded} pixels`);
  clearInterval(ticker);

  server.send([sample(0, now, [0.4, 0, 0.1]), sample(1, now, [0.7, 0, 0.1], {flags: ['stale']})]);
  await wait(() => document.body.dataset.quality === 'bad');
  check(
      await page.evaluate(() => document.body.dataset.link === 'live' && document.querySelector('#state').textContent === '') &&
          /No new measurement/.test(await text(page, '#reason')),
      'a silent sensor is grey while another one sends');
  server.send([]);
  await wait(() => document.body.dataset.link === 'silent');
  const changed = await changeOfScene(page, drawn, changed => changed > 1500);
  check(changed > 1500, `sensors and ellipsoids are drawn while there are poses: ${changed} pixels differ without`);
  check(
      await text(page, '#state') === '' && await page.evaluate(() => getComputedStyle(document.querySelector('#numbers')).opacity) < 0.5,
      'without poses numbers are grey');
  check(await text(page, '#health') === '0.0 % missing, 42 °C', 'without a warning the health is two numbers');
  const warning = 'more than 1 % of the columns are missing';
  server.send([], {recording_error: 'take1: recording ended early (No space left on device)', health: {...healthy, warning}});
  await wait(() => /ended early .No space/.test(document.querySelector('#problem').textContent));
  check(
      await text(page, '#health') === warning && await page.getAttribute('#health', 'data-warning') === 'true',
      'a failed recording and a warning are shown');
  now += 2000;
  both(10);
  await wait(() => document.body.dataset.quality === 'good');
  const gap = await page.evaluate(() => {
    const {length, times, columns} = window.tricoil.sensors.get(0).history;
    const n = times.subarray(0, length).findIndex((t, i) => i > 0 && t - times[i - 1] > 0.5);
    return n > 0 && [columns.x[n], columns.speed[n], columns.speed[n + 1]].map(Number.isFinite);
  });
  check(gap && gap.every(known => !known), 'two seconds without poses are a gap in the plots');
  check(errors.length === 0, `no errors in the page ${errors.join('; ')}`);
  await close();
}

/// Each trouble: its flag, and what the page must say.
const kTroubles = [
  ['no_reference', 'bad', /No source current/, /power and the cable of the source/], ['no_sensor', 'bad', /No sensor found/, /plug and the cable/],
  ['saturated', 'bad', /saturated/, /away from the source/], ['low_signal', 'bad', /too weak/, /closer to the source/],
  ['distorted', 'caution', /Metal disturbs the field: distortion of about 6.50 mm/, /Remove metal/],
  ['columns_missing', 'caution', /missing/, /link to the device/],
  ['roll_undefined', 'caution', /roll is undefined/, /x axis/]
];

async function troubles(browser, html, check, pictures) {
  const {server, page, errors, wait, close} = await openPage(browser, html);
  let now = 1.7e12;
  let present = {};  // of the poses that are sent now
  const ticker = setInterval(() => server.send([sample(0, now += kFrame_ms, [0.5, -0.1, 0.1], present)]), 60);
  await wait(
      () => document.body.dataset.quality === 'good' && window.tricoil.firstPictureMs && Number(document.querySelector('#expected').textContent) > 0);
  for (const [flag, level, sentence, remedy] of kTroubles) {
    // The covariance of a distorted pose contains its distortion.
    present = {flags: [flag], ...(flag === 'distorted' && {distortion: 6.5, covariance: [1.4e-5, 0, 0, 1.4e-5, 0, 1.4e-5]})};
    await wait(wanted => document.body.dataset.quality === wanted, level);
    await wait(source => new RegExp(source).test(document.querySelector('#reason').textContent), sentence.source);
    check(
        remedy.test(await text(page, '#remedy')) && await text(page, '#word') === (level === 'bad' ? 'not usable' : 'caution'),
        `${flag}: "${await text(page, '#reason')} ${await text(page, '#remedy')}"`);
    await wait(source => new RegExp(`^Sensor 1: .*${source}`).test(document.querySelector('#announcement').textContent), sentence.source);
    check(true, `a screen reader is told: ${await text(page, '#announcement')}`);
    if (flag === 'no_sensor') {
      present = {flags: ['no_sensor', 'stale']};
      await wait(() => window.tricoil.newest.names.join() === 'no_sensor,stale' && window.tricoil.link === 'live');
      check(/No sensor found/.test(await text(page, '#reason')), 'a sensor that is unplugged for long is not taken for a silent device');
      const numbers = () =>
          page.$$eval('#numbers dd:not([data-unit]), #jitter, #snr, #expected, #distortion', parts => parts.map(part => part.textContent).join(' '));
      await wait(() => document.querySelector('#snr').textContent === '–');
      check(!/\d/.test(await numbers()), `beside "No sensor found" there is no number: ${await numbers()}`);
    }
    if (flag !== 'distorted') continue;
    await wait(() => document.querySelector('#expected').textContent === '6.48');
    check(await page.getAttribute('#distortion_bar', 'data-over') === 'true', 'metal widens the expected error, and its tile is marked');
    await save(page, pictures, 'metal');
  }
  present = {distortion: 2.5};
  await wait(() => /2.50 mm, above the limit of 2.00 mm/.test(document.querySelector('#reason').textContent));
  check(
      await page.evaluate(() => document.body.dataset.quality) === 'caution',
      `distortion above the limit is not green, even without a flag: ${await text(page, '#reason')}`);
  present = {covariance: [1.44e-6, 0, 0, 1.44e-6, 0, 3.88e-6]};
  await wait(() => /2.60 mm RMS, above the limit of 2.00 mm/.test(document.querySelector('#reason').textContent));
  check(await page.evaluate(() => document.body.dataset.quality) === 'caution', `neither is an expected error: ${await text(page, '#reason')}`);

  present = {flags: ['hemisphere_unknown']};
  await wait(() => document.querySelectorAll('#sides button').length === 2);
  const sides = await page.$$eval('#sides button', buttons => buttons.map(button => button.textContent));
  check(
      /The sensor is back/.test(await text(page, '#reason')) && sides.join() === '+x,−x',
      `after a loss the page asks for the side: ${await text(page, '#remedy')} ${sides.join(' ')}`);
  await page.waitForTimeout(300);  // until the scene is drawn
  await save(page, pictures, 'lost-sensor');
  await page.click('#sides button >> nth=1');
  await wait(() => document.querySelector('#answer').textContent === 'done');
  check(JSON.stringify(server.asked.at(-1)) === '{"hemisphere":[-1,0,0],"sensor":0}', 'the answer sets the hemisphere of this sensor');

  present = {};
  await page.click('#run');
  check(await page.isVisible('#stop_dialog') && /everyone/.test(await text(page, '#stop_dialog')), 'stopping the coils asks first');
  const asked = server.asked.length;
  await page.keyboard.press('Enter');  // the safe answer has the focus
  await wait(() => !document.querySelector('#stop_dialog').open);
  check(server.asked.length === asked, 'the safe answer changes nothing');
  check(errors.length === 0, `no errors in the page ${errors.join('; ')}`);
  clearInterval(ticker);
  await close();
}

module.exports = async function pageStates(browser, html, check, pictures) {
  await twoSensors(browser, html, check, pictures);
  await troubles(browser, html, check, pictures);
};
