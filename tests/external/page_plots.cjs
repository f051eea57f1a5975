// Plots, settings and layout of the live page, with generated poses.
const fs = require('fs');
const {openPage, save, text, whileSending} = require('./page_check.cjs');
const {sample} = require('./scripted_server.cjs');

const kStep_ms = 1000 / 240;
const kStart_ms = 1.7e12;
const kSpike_m = 0.9;

const shown = page => page.evaluate(() => ({
                                      range: [...window.tricoil.plots.range],
                                      bands: window.tricoil.plots.bands.map(band => band.level),
                                      points: window.tricoil.plots.charts[0].data[0].length,
                                      highest: Math.max(...window.tricoil.plots.charts[0].data[1].filter(v => v !== null))
                                    }));

async function everyPose(page, server, wait, check, pictures) {
  const poses = [];
  for (let n = 0; n < 10_000; ++n) {
    const more = n > 5000 && n < 5600 ? {flags: ['low_signal']} : n > 7000 && n < 8000 ? {flags: ['distorted'], distortion: 4} : {};
    poses.push(sample(0, kStart_ms + n * kStep_ms, [n === 9000 ? kSpike_m : 0.4 + 0.1 * Math.sin(n / 300), 0.1 * Math.cos(n / 300), 0.1], more));
  }
  const began = Date.now();
  server.send(poses);
  await wait(() => window.tricoil.poses === 10_000);
  // The time depends on the wall clock, so it is printed but not checked.
  check(
      await page.evaluate(() => window.tricoil.sensors.get(0).history.length) === 10_000,
      `10,000 poses at once are taken, in ${Date.now() - began} ms`);
  await wait(() => window.tricoil.firstPictureMs);
  await page.selectOption('#window', '60');
  server.send([sample(0, kStart_ms + 10_000 * kStep_ms, [0.4, 0.1, 0.1])]);
  await wait(() => window.tricoil.plots.range[0] < -50 && window.tricoil.plots.charts[0].data[0].length > 500);
  const {points, highest, bands} = await shown(page);
  check(points < 4000 && highest === 1000 * kSpike_m, `one pose among 10,000 is seen in ${points} points: ${highest} mm`);
  check(bands.join() === '2,1', 'invalid poses and metal are bands');
  await save(page, pictures, 'minute');
}

async function pauseAndZoom(page, server, wait, check) {
  await page.click('#pause');
  await wait(() => window.tricoil.plots.frozen && window.tricoil.plots.drawn === window.tricoil.plots.frozen);
  const box = await page.locator('.u-over').first().boundingBox();
  /// Position of the n-th pose on the screen.
  const place = n => page.evaluate(time => {
                           const {from, to} = window.tricoil.plots.shown;
                           return (time - from) / (to - from);
                         }, (kStart_ms + n * kStep_ms) / 1000).then(share => box.x + share * box.width);
  await page.mouse.move(await place(9200), box.y + 20);
  const values = await page.$$eval('figcaption output', outputs => outputs.map(output => output.textContent));
  check(values.filter(value => value !== '–').length === values.length, `the cursor reads all plots: ${values.join(' ')}`);
  await page.mouse.down();
  await page.mouse.move(await place(9800), box.y + 25, {steps: 4});
  await page.mouse.up();
  await wait(() => window.tricoil.plots.range[1] - window.tricoil.plots.range[0] < 3);
  const {range, points} = await shown(page);
  check(range[1] - range[0] > 2 && points > 500, `dragging zooms to ${(range[1] - range[0]).toFixed(2)} s`);
  const [download] = await Promise.all([page.waitForEvent('download'), page.keyboard.press('e')]);
  const lines = fs.readFileSync(await download.path(), 'utf8').trim().split('\n');
  const expected = (range[1] - range[0]) * 240;
  check(
      lines[0].startsWith('time_s,sensor,x_mm,y_mm,z_mm,qw') && lines.every(line => line.split(',').length === lines[0].split(',').length) &&
          Math.abs(lines.length - 1 - expected) < 4,
      `CSV of what is shown has every pose: ${lines.length - 1} lines for ${expected.toFixed(0)}`);
  await page.keyboard.press('k');
  await wait(() => window.tricoil.plots.range[1] === 0);
  check(await page.textContent('#pause') === 'Pause' && (await shown(page)).range[1] === 0, 'a key follows again');
}

/// A circle of 0.15 m, once a second, with +-0.05 mm of noise along x.
async function figures(page, server, wait, check) {
  const t0 = 1.75e12;
  let n = 0;
  const send = () => {
    for (const end = n + 240; n < end; ++n) {
      const angle = 2 * Math.PI * n / 240;
      server.send([sample(0, t0 + n * kStep_ms, [0.5 + 0.15 * Math.cos(angle) + (n % 2 ? 5e-5 : -5e-5), 0.15 * Math.sin(angle), 0.1])]);
    }
  };
  send();
  await whileSending(send, () => wait(() => {
                             const number = id => Number(document.getElementById(id).textContent);
                             return number('rate') === 240 && number('latency') === 4 && number('jitter') > 0.045 && number('jitter') < 0.07;
                           }));
  check(true, `rate and latency, and a jitter without the motion: ${await text(page, '#jitter')} mm`);
}

async function settingsStay(page, server, wait, check) {
  await page.selectOption('#units', 'in');
  await page.selectOption('#order', 'vector');
  server.send([sample(0, 1.8e12, [0.254, 0, 0.1], {q: [Math.SQRT1_2, 0, 0, Math.SQRT1_2]})]);
  await wait(() => document.querySelector('#p0').textContent === '10.000');
  check(
      await text(page, '#a2') === '90.00' && await text(page, '#n2') === 'vector z' && /in/.test(await text(page, '#plots figcaption')),
      'units and angles can be chosen, in numbers and plots');
  check(/^0\.7071 {2}0\.0000 {2}0\.0000 {2}0\.7071$/.test(await text(page, '#quaternion')), 'the quaternion is shown');
  await page.keyboard.press('m');
  await page.keyboard.press('m');
  check(await page.evaluate(() => document.documentElement.dataset.theme) === 'dark', 'a key makes it dark');
  await page.reload();
  await wait(() => window.tricoil);
  check(
      await page.evaluate(() => document.documentElement.dataset.theme === 'dark' && document.querySelector('#units').value === 'in'),
      'settings stay after a reload');
}

async function layouts(browser, html, check, pictures) {
  for (const [width, height] of [[390, 844], [768, 1024], [1024, 768], [1400, 900], [3840, 2160]]) {
    const {server, page, errors, wait, close} =
        await openPage(browser, html, {viewport: {width, height}, colorScheme: width === 1400 ? 'dark' : 'light'});
    for (let n = 0; n < 60; ++n) server.send([sample(0, 1.7e12 + 33 * n, [0.4, n / 1000, 0.1])]);
    await wait(() => window.tricoil.poses === 60 && window.tricoil.firstPictureMs);
    const over = await page.evaluate(() => {
      const wide = [...document.querySelectorAll('header *, #guide *, #tiles *, #plot_bar *, #plots figcaption')].filter(
          part => part.getClientRects().length && part.getBoundingClientRect().right > innerWidth + 1);
      return [document.documentElement.scrollWidth - innerWidth, ...wide.map(part => part.id || part.tagName)];
    });
    check(over.length === 1 && over[0] <= 0, `${width} x ${height}: nothing leaves the screen ${over.slice(1)}`);
    const unnamed = await page.evaluate(
        () => [...document.querySelectorAll('button, select, input, dialog, section, nav, aside')]
                  .filter(part => !(part.textContent.trim() || part.ariaLabel || part.labels?.length || part.getAttribute('aria-labelledby')))
                  .map(part => part.id || part.tagName));
    check(unnamed.length === 0, `${width} x ${height}: every part has a name for a screen reader ${unnamed}`);
    await save(page, pictures, `layout-${width}`);
    check(errors.length === 0, `no errors in the page ${errors.join('; ')}`);
    await close();
  }
}

module.exports = async function pagePlots(browser, html, check, pictures) {
  const {server, page, errors, wait, close} = await openPage(browser, html);
  await everyPose(page, server, wait, check, pictures);
  await pauseAndZoom(page, server, wait, check);
  await figures(page, server, wait, check);
  await settingsStay(page, server, wait, check);
  check(errors.length === 0, `no errors in the page ${errors.join('; ')}`);
  await close();
  await layouts(browser, html, check, pictures);
};
