// The live page with generated poses: several sensors, a silent sensor, gaps, covariance ellipsoids.
const http = require('http');
const path = require('path');

/// Pose in the form in which the server sends it; t in ms.
function pose(sensor, t, x, more) {
  return {sensor, utc_ms: t, position_m: [x, 0.1 * sensor, 0.1], q_wxyz: [1, 0, 0, 0],
          position_covariance_m2: [8e-7, 0, 0, 1.6e-5, 0, 1.6e-5], valid: 1, stale: false, flag_names: '', state_name: 'tracking', snr_db: 60, distortion_mm: 1, predicted_error_mm: 0.2, ...more};
}

const healthy = {warning: '', missing_percent: 0, temperature_c: 41.6};

/// Serves the page `html`; send() adds events to its stream.
async function scripted(html) {
  const streams = new Set();
  const server = http.createServer((request, response) => {
    if (request.url !== '/stream') return response.writeHead(200, {'Content-Type': 'text/html'}).end(html);
    response.writeHead(200, {'Content-Type': 'text/event-stream'});
    response.flushHeaders();
    streams.add(response);
    response.on('close', () => streams.delete(response));
  });
  await new Promise(resolve => server.listen(0, '127.0.0.1', resolve));
  return {
    url: `http://127.0.0.1:${server.address().port}/`,
    connected: () => streams.size > 0,
    send(poses, status = {running: true, recording: false, recording_error: '', health: healthy}) {
      for (const stream of streams) stream.write(`data: ${JSON.stringify({status, poses})}\n\n`);
    },
    close() { server.close(); server.closeAllConnections(); },
  };
}

/// Number of orange pixels in the picture: ellipsoids, and a few hundred pixels of the source's x axis.
async function orangePixels(page) {
  const picture = (await page.screenshot({clip: {x: 0, y: 60, width: 760, height: 600}})).toString('base64');
  return page.evaluate(async data => {
    const image = new Image();
    image.src = 'data:image/png;base64,' + data;
    await image.decode();
    const canvas = Object.assign(document.createElement('canvas'), {width: image.width, height: image.height});
    const context = canvas.getContext('2d');
    context.drawImage(image, 0, 0);
    const bytes = context.getImageData(0, 0, canvas.width, canvas.height).data;
    let count = 0;
    for (let n = 0; n < bytes.length; n += 4) count += bytes[n] > 200 && bytes[n] - bytes[n + 1] > 20 && bytes[n + 1] - bytes[n + 2] > 20;
    return count;
  }, picture);
}

module.exports = async function pageStates(browser, html, check, pictures) {
  const server = await scripted(html);
  const page = await browser.newPage({viewport: {width: 1280, height: 800}});
  const wait = (condition, argument = null) => page.waitForFunction(condition, argument, {timeout: 30000});
  const picture = name => pictures ? page.screenshot({path: path.join(pictures, `${name}.png`)}) : null;
  let now = 1.7e12;
  /// Sends `count` events, one frame apart, with poses of both sensors. The pose of the second sensor is slightly older.
  const both = (count, more = {}) => {
    for (let n = 0; n < count; ++n, now += 33) server.send([pose(0, now, 0.4 + n / 400, more), pose(1, now - 4, 0.7 - n / 400, more)]);
  };
  try {
    await page.goto(server.url);
    while (!server.connected()) await page.waitForTimeout(20);
    both(1);
    await wait(() => window.tricoil.firstPictureMs);
    both(60);
    await wait(() => window.tricoil.poses === 122);
    const lengths = () => page.evaluate(() => [...window.tricoil.sensors.values()].map(sensor => sensor.history.times.length));
    check((await lengths()).every(length => length >= 60), `each of two sensors keeps its own plots: ${await lengths()} poses`);
    const fastest = await page.evaluate(() => Math.max(...window.tricoil.sensors.get(0).history.columns[3]));
    check(fastest < 1, `no sensor jumps to the position of another: ${fastest.toFixed(2)} m/s at most`);
    check(await page.isVisible('#sensor') && /y +0\.0 /.test(await page.textContent('#numbers')), 'the numbers are the first sensor\'s');
    await page.keyboard.press('b');
    await page.selectOption('#sensor', {value: '1'});
    await wait(() => /y +100\.0 /.test(document.querySelector('#numbers').textContent));
    check(await page.evaluate(() => window.tricoil.boresight === null && window.tricoil.sensors.get(0).boresight !== null),
          'the second sensor can be chosen, and has its own boresight');
    const ticker = setInterval(() => both(1), 100);  // keeps the stream alive while a picture is drawn
    await wait(() => document.body.dataset.link === 'live' && document.body.dataset.pose === 'good');
    await picture('two-sensors');
    const said = await page.textContent('#ellipsoid');
    const orange = await orangePixels(page);
    clearInterval(ticker);
    check(orange > 1500 && /3 sigma ellipsoid, drawn x\d+/.test(said), `the ellipsoids are drawn: ${orange} pixels ("${said}")`);

    server.send([pose(0, now, 0.4), pose(1, now, 0.7, {valid: false, stale: true, flag_names: 'stale'})]);
    await wait(() => document.body.dataset.pose === 'bad');
    check(await page.evaluate(() => document.body.dataset.link === 'live' && document.querySelector('#state').textContent === ''),
          'a silent sensor is grey while another one sends');
    server.send([]);
    await wait(() => document.body.dataset.link === 'silent');
    await page.waitForTimeout(300);
    await picture('silent');
    check(await page.textContent('#state') === '', 'without poses the state is empty');
    check(await page.evaluate(() => getComputedStyle(document.querySelector('#numbers')).opacity) < 0.5, 'without poses numbers are grey');
    check(await orangePixels(page) < 300, 'without poses no sensor is drawn');
    const warning = 'more than 1 % of the columns are missing';
    check(await page.textContent('#health') === '0.0 % missing, 42 °C', 'without a warning the health is two numbers');
    server.send([], {running: true, recording: false, recording_error: 'take1: recording ended early (No space left on device)',
                     health: {...healthy, warning}});
    await wait(() => /ended early .No space/.test(document.querySelector('#recording_error').textContent));
    check(true, 'the reason why a recording ended is shown');
    check(await page.textContent('#health') === warning && await page.getAttribute('#health', 'data-warning') === 'true', 'a warning is shown');
    now += 2000;
    both(10);
    await wait(() => document.body.dataset.pose === 'good');
    const gap = await page.evaluate(() => {
      const {times, columns} = window.tricoil.sensors.get(0).history;
      const n = times.findIndex((t, i) => i > 0 && t - times[i - 1] > 0.5);
      return n > 0 && [columns[0][n], columns[3][n], columns[3][n + 1]];
    });
    check(gap && gap.every(value => value === null), 'two seconds without poses are a gap in the plots');
    await page.waitForTimeout(300);
    await picture('gap');
  } finally {
    await page.close();
    server.close();
  }
};
