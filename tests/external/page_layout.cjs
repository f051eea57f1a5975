// Plots of the live page that the user arranges, and the playback beside them: time line, links, true poses of a file.
const {openPage, save, text} = require('./page_check.cjs');
const {sample} = require('./scripted_server.cjs');

const kRate = 100;
const kSeconds = 20;
const kTenHours_s = 36000;

/// shift: seconds that the recording begins later; raised: of y, in m.
function recording(shift = 0, raised = 0) {
  const lines = ['{"name":"take","started":"","complete":true}'];
  for (let n = 0; n <= kSeconds * kRate; ++n) {
    const t = n / kRate;
    lines.push(JSON.stringify(sample(0, 1000 * (t + shift), [0.5 + 0.001 * Math.sin(t), 0.2 + raised + 0.1 * Math.sin(t), 0.01 * t])));
  }
  return lines.join('\n') + '\n';
}

const layout = page =>
    page.evaluate(() => window.tricoil.plots.charts.map(({spec}) => `${spec.title}: ${spec.series.map(({name}) => name).join(' ')}`));
const mark = (page, names) => page.evaluate(names => {
  for (const box of document.querySelectorAll('#plot_signals input')) box.checked = names.includes(box.name);
}, names);

async function arrange(page, wait, check, pictures) {
  await page.evaluate(() => window.tricoil.plots.freeze(1.7e9, 1.7e9 + 5));  // the poses stay in the time shown
  check((await layout(page)).length === 6 && (await layout(page))[0] === 'position: x y z', 'the default has six plots');
  await page.click('#plots figure:first-child figcaption button');
  await page.click('#plot_split');
  check((await layout(page)).slice(0, 3).join() === 'position: x,position: y,position: z', 'position plots each have their own axis');
  const spans = await page.evaluate(() => window.tricoil.plots.charts.slice(0, 3).map(({u}) => u.scales.y.max - u.scales.y.min));
  check(spans[0] < 5 && spans[1] > 200, `a millimetre along x is seen beside 200 mm along y: ${spans.map(v => v.toFixed(1))}`);
  await page.click('#plots figure:nth-child(2) figcaption button');
  await mark(page, ['y', 'snr', 'speed']);
  await page.check('#plot_deviation');
  await page.click('#plot_set');
  check((await layout(page))[1] === 'position, speed, signal to noise − mean: y speed snr', 'any signal can be put on a plot');
  const {mean, scales} = await page.evaluate(() => {
    const {data: [, y], u} = window.tricoil.plots.charts[1];
    return {mean: y.filter(Number.isFinite).reduce((a, b) => a + b, 0) / y.length, scales: Object.keys(u.scales)};
  });
  check(Math.abs(mean) < 3 && scales.length === 4, `a deviation is about zero, and each unit has a scale: ${mean.toFixed(2)} mm, ${scales}`);
  await page.click('#new_plot');
  await mark(page, ['qw', 'a0']);
  await page.click('#plot_set');
  const arranged = await layout(page);
  check(arranged.length === 9 && arranged[8] === 'attitude, quaternion: a0 qw', 'a plot can be added');
  await page.click('#new_plot');
  await mark(page, ['x', 'y', 'z', 'a0', 'a1', 'a2', 'speed', 'snr']);
  await page.click('#plot_split');
  const why = await page.textContent('#plot_why');
  await page.click('#plot_dialog [data-cancel]');
  check((await layout(page)).length === 9 && why.includes('12'), `more plots than fit are refused: ${why}`);
  await save(page, pictures, 'layout-own');
  await page.reload();
  await wait(() => window.tricoil?.plots);
  check((await layout(page)).join() === arranged.join(), 'the layout is kept');
  for (const bad of ['[]', '[{"signals":["nothing"],"deviation":false}]', '[{"signals":[],"deviation":true}]', '"x"', '[null]']) {
    await page.evaluate(bad => localStorage.setItem('tricoil', `{"plots":${bad}}`), bad);
    await page.reload();
    await wait(() => window.tricoil?.plots);
    check((await layout(page)).length === 6, `a stored layout ${bad} is left out`);
  }
}

/// Waits until the line of the time is at `share` of the width of the plots.
const lineAt = (wait, share) => wait(share => {
  const line = document.querySelector('#plots .now'), plot = line.parentElement.getBoundingClientRect();
  return !line.hidden && Math.abs((line.getBoundingClientRect().left + 1 - plot.left) / plot.width - share) < 0.03;
}, share);

async function timeLine(page, wait, check, pictures) {
  await page.keyboard.press('t');
  check(await page.isVisible('#tools') && await page.isVisible('#plots canvas') && await page.isVisible('#scene'), 'the tools open beside the plots');
  await page.getByRole('button', {name: 'Play'}).first().click();
  await wait(() => window.tricoil.playback?.t > 0.2);
  await page.click('#play');
  await wait(() => !window.tricoil.playback.playing && window.tricoil.plots.range[1] > 19);
  check((await page.evaluate(() => [...window.tricoil.plots.range])).join() === `0,${kSeconds}`, 'the plots show the whole recording');
  const box = await page.locator('.u-over').first().boundingBox();
  await page.mouse.click(box.x + 0.75 * box.width, box.y + 20);
  await page.mouse.move(0, 0);
  await wait(() => Math.abs(window.tricoil.playback.t - 15) < 0.2);
  await lineAt(wait, 0.75);
  check(true, `a click on a plot leads to its time, where the line is: ${await text(page, '#play_time')}`);
  const y = await page.evaluate(() => Number(document.querySelector('figcaption .key:nth-of-type(2) output').textContent.replace('−', '-')));
  const t = await page.evaluate(() => window.tricoil.playback.t);
  check(Math.abs(y - 200 - 100 * Math.sin(t)) < 4, `the plots read the values at the line: y ${y} mm`);
  await save(page, pictures, 'playback-line');
  await page.mouse.move(box.x + 0.5 * box.width, box.y + 20);
  await page.mouse.down();
  await page.mouse.move(box.x + 0.9 * box.width, box.y + 25, {steps: 4});
  await page.mouse.up();
  await page.mouse.move(0, 0);
  await wait(() => window.tricoil.plots.range[1] - window.tricoil.plots.range[0] < 9);
  await lineAt(wait, 0.625);
  check(Math.abs(await page.evaluate(() => window.tricoil.playback.t) - t) < 1e-6, 'a zoom leaves the time as it is');
  await page.click('#pause');
  await wait(() => window.tricoil.plots.range[1] > 19);
  check(true, 'a button shows the whole recording again');
}

async function beside(page, wait, check, pictures) {
  const row = page.locator('tr', {has: page.getByRole('cell', {name: 'take two', exact: true})});
  await row.getByRole('button', {name: 'Beside'}).click();
  await wait(
      () => window.tricoil.playback?.beside === 'take two' && window.tricoil.plots.charts[0].spec.series.length === 6 &&
          window.tricoil.plots.charts[0].data[0].length > 100);
  const {own, other} = await page.evaluate(() => {
    const {data: [times, , y, , , otherY]} = window.tricoil.plots.charts[0];
    const near = (values, t) => values.filter((v, n) => Math.abs(times[n] - t) < 0.1).filter(Number.isFinite)[0];
    return {own: near(y, 4), other: near(otherY, 4)};
  });
  check(
      Math.abs(other - own - 30) < 3, `a second recording is beside the first, from the same start: y ${own.toFixed(1)} and ${other.toFixed(1)} mm`);
  check(
      await page.evaluate(() => [...window.tricoil.scene.sensors.values()].filter(({triad}) => triad.visible).length) === 2 &&
          await page.isVisible('#sensor') && await page.locator('#sensor').innerText() === '1\nB1',
      'both sensors are in the scene, and each can be chosen');
  await wait(() => /take one, beside take two/.test(document.querySelector('#play_name').textContent));
  check(true, 'the page names both');
  await save(page, pictures, 'beside');
  await row.getByRole('button', {name: 'Play'}).click();
  await wait(() => window.tricoil.playback?.name === 'take two' && window.tricoil.plots.charts[0].spec.series.length === 3);
  check(await page.evaluate(() => window.tricoil.playback.sensors.size) === 1, 'another recording is shown alone');
  await page.getByRole('button', {name: 'Play', exact: true}).first().click();
  await wait(() => window.tricoil.playback?.name === 'take one' && window.tricoil.playback.t > 1);
  await page.click('#play');
  await wait(() => !window.tricoil.playback.playing);
}

async function link(browser, server, page, wait, check) {
  await page.click('#copy_link');
  const url = page.url(), at = await page.evaluate(() => window.tricoil.playback.t);
  const moment = Number(/#recording=take\+one&t=([\d.]+)$/.exec(url)?.[1]);
  check(Math.abs(moment - at) < 1e-3, `the link names recording and time: ${url.split('/').at(-1)}`);
  const other = await browser.newPage({viewport: {width: 1000, height: 700}});
  other.setDefaultTimeout(120000);
  await other.goto(url.replace('#', '#token=abc&'));
  await other.waitForFunction(() => window.tricoil?.playback);
  check(
      await other.evaluate(t => Math.abs(window.tricoil.playback.t - t) < 1e-3 && !window.tricoil.playback.playing, at),
      'another page opens the same recording at the same moment, and its token is kept out of the address');
  check(!other.url().includes('token') && /recording=take\+one/.test(other.url()), `its address: ${other.url().split('/').at(-1)}`);
  await other.evaluate(() => location.assign('#recording=take+one&t=0.500'));
  await other.waitForFunction(() => Math.abs(window.tricoil.playback.t - window.tricoil.playback.from - 0.5) < 1e-3);
  check(true, 'a link to another moment of the recording that is open leads there');
  await other.goto(url.replace(/#.*/, '#recording=none&t=x'));
  await other.reload();
  await other.waitForFunction(() => /no recording/.test(document.querySelector('#answer').textContent));
  check(await other.evaluate(() => window.tricoil.playback === null), 'a link to a recording that is gone says so, and the page is live');
  await other.close();
  await page.keyboard.press('Escape');
  check(!page.url().includes('#'), 'the live page has no moment in its address');
  await page.evaluate(() => location.assign('#recording=take+one&t=0'));
  await wait(() => window.tricoil.playback);
  await page.waitForTimeout(500);
  const range = await page.evaluate(() => [...window.tricoil.plots.range].join());
  check(range === `0,${kSeconds}`, `a link to the start shows the whole recording: ${range}`);
  await page.keyboard.press('Escape');
}

const kHead =
    'sensor,time_us,flags,x_m,y_m,z_m,qw,qx,qy,qz,std_x_m,std_y_m,std_z_m,distortion_mm,snr_db,true_x_m,true_y_m,true_z_m,true_qw,true_qx,true_qy,true_qz,error_position_m';
/// A file of `run --out`, with the truth 2 mm beside the pose. error: as the file states it.
const csv = (error, truth = '0.402,0,0.1,1,0,0,0') =>
    [kHead, ...Array.from({length: 300}, (_, n) => `0,${n * 10000},0,0.4,0,0.1,1,0,0,0,0.001,0.001,0.001,0.1,60,${truth},${error}`)].join('\n') +
    '\n';

async function truth(page, wait, check) {
  const open = async text => {
    await page.setInputFiles('#file', {name: 'run.csv', mimeType: 'text/csv', buffer: Buffer.from(text)});
    await wait(() => window.tricoil.playback?.t > 0.1 && window.tricoil.scene?.sensors.get(0).triad.visible);
    const drawn = await page.evaluate(() => {
      const {ghost, arrow} = window.tricoil.scene.sensors.get(0).truth;
      return {ghost: ghost.visible, arrow: arrow.visible, mm: window.tricoil.newest.true_mm};
    });
    await page.keyboard.press('Escape');
    return drawn;
  };
  const drawn = await open(csv(0.002));
  check(drawn.ghost && drawn.arrow && Math.abs(drawn.mm - 2) < 1e-6, 'a file of a simulation shows its true sensor and the error');
  check(
      await page.evaluate(() => window.tricoil.plots.charts.some(({spec}) => spec.series.some(({name}) => name === 'true'))),
      'and plots the true error');
  for (const [bad, what] of [
           [csv(0.5), 'of another frame'], [csv(0.002, 'nan,0,0.1,1,0,0,0'), 'that is not a number'], [csv('', ',,,,,,'), 'that is empty']])
    check(!(await open(bad)).ghost, `a truth ${what} is not drawn`);
}

/// Ten hours, four poses a second.
function tenHours() {
  const lines = ['{"name":"long","started":"","complete":true}'];
  for (let n = 0; n < 4 * kTenHours_s; ++n)
    lines.push(`[0,${n * 250000},${n * 250},0,1,0.${400 + n % 100},0,0.1,1,0,0,0,1e-8,0,0,4e-8,0,4e-8,0.2,0.3,0.1,60]`);
  return lines.join('\n') + '\n';
}

async function longRecording(page, wait, check) {
  const began = Date.now();
  await page.locator('tr', {has: page.getByRole('cell', {name: 'long', exact: true})}).getByRole('button', {name: 'Play'}).click();
  await wait(() => window.tricoil.playback?.name === 'long');
  await wait(seconds => window.tricoil.plots.range[1] > seconds - 1, kTenHours_s);
  await wait(() => /\/ 600:00|\/ 599:59/.test(document.querySelector('#play_time').textContent));
  check(true, `a recording of ten hours is played, after ${Date.now() - began} ms: ${await text(page, '#play_time')}`);
  await page.keyboard.press('Escape');
}

module.exports = async function pageLayout(browser, html, check, pictures) {
  const recordings = {
    'take one': recording(),
    'take two': recording(500, 0.03),
    'long': tenHours(),
    'none': {status: 422, answer: 'there is no recording of this name'}
  };
  const {server, page, errors, wait, close} = await openPage(browser, html, {recordings});
  for (let n = 0; n < 500; ++n) server.send([sample(0, 1.7e12 + 10 * n, [0.5 + 0.001 * Math.sin(n / 50), 0.2 + 0.1 * Math.sin(n / 50), 0])]);
  await wait(() => window.tricoil.firstPictureMs && window.tricoil.poses === 500);
  await arrange(page, wait, check, pictures);
  server.send([sample(0, 1.7e12 + 6000, [0.4, 0, 0.1])]);
  await wait(() => window.tricoil.firstPictureMs);
  await timeLine(page, wait, check, pictures);
  await beside(page, wait, check, pictures);
  await link(browser, server, page, wait, check);
  await truth(page, wait, check);
  await longRecording(page, wait, check);
  check(errors.length === 0, `no errors in the page ${errors.join('; ')}`);
  await close();
};
