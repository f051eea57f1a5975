// Helpers of the browser tests: a page of a scripted server, and what it has drawn.
const {spawn} = require('child_process');
const path = require('path');
const {scripted} = require('./scripted_server.cjs');

/// Starts `tricoil serve` with the page at `port`, 0: a free one. Resolves once it has printed its addresses, with these and end().
function serve(program, port, options) {
  const child = spawn(program, ['serve', '--json', '--web', String(port), ...options], {stdio: ['ignore', 'pipe', 'inherit']});
  return new Promise((resolve, reject) => {
    child.once('exit', code => reject(new Error(`tricoil serve ended with ${code}`)));
    child.stdout.once('data', data => resolve({
                                ...JSON.parse(data),
                                end: () => {
                                  child.removeAllListeners('exit');
                                  child.kill('SIGKILL');
                                }
                              }));
  });
}

/// Opens the page of a new scripted server. errors: of the page. send() of the server adds events.
async function openPage(browser, html, {
  viewport = {
    width: 1400,
    height: 900
  },
  recordings = {},
  ...context
} = {}) {
  const server = await scripted(html, recordings);
  const own = await browser.newContext({viewport, ...context});
  const page = await own.newPage();
  page.setDefaultTimeout(120000);  // rendered in software: on a busy machine each step may take long
  const errors = [];
  page.on('pageerror', error => errors.push(String(error)));
  await page.goto(server.url);
  while (!server.connected()) await page.waitForTimeout(20);
  const wait = (condition, argument = null) => page.waitForFunction(condition, argument);
  return {
    server,
    page,
    errors,
    wait,
    close: async () => {
      await own.close();
      server.close();
    }
  };
}

/// Number of pixels that differ between two pictures of the scene.
async function changedPixels(page, before, after) {
  return page.evaluate(async pictures => {
    const [a, b] = await Promise.all(pictures.map(async data => {
      const image = new Image();
      image.src = 'data:image/png;base64,' + data;
      await image.decode();
      const canvas = Object.assign(document.createElement('canvas'), {width: image.width, height: image.height});
      const context = canvas.getContext('2d');
      context.drawImage(image, 0, 0);
      return context.getImageData(0, 0, canvas.width, canvas.height).data;
    }));
    let count = 0;
    for (let n = 0; n < a.length; n += 4) count += Math.abs(a[n] - b[n]) + Math.abs(a[n + 1] - b[n + 1]) + Math.abs(a[n + 2] - b[n + 2]) > 60;
    return count;
  }, [before, after].map(picture => picture.toString('base64')));
}

/// Asks isDone() every 300 ms until it is true, for a minute at most: a busy machine draws late.
async function poll(page, isDone) {
  const end = Date.now() + 60000;
  while (!await isDone() && Date.now() < end) await page.waitForTimeout(300);
}

/// Changed pixels of the scene as soon as isExpected() is true of them, or the last ones.
async function changeOfScene(page, before, isExpected) {
  let changed = 0;
  await poll(page, async () => {
    changed = await changedPixels(page, before, await pictureOf(page, '#scene'));
    return isExpected(changed);
  });
  return changed;
}

/// Picture of the scene when it no longer changes. Two frames are drawn between pictures, as a busy machine may draw none for a while.
async function settledScene(page) {
  let picture = null;
  await poll(page, async () => {
    const before = picture;
    await page.evaluate(() => new Promise(done => requestAnimationFrame(() => requestAnimationFrame(done))));
    picture = await pictureOf(page, '#scene');
    return before && await changedPixels(page, before, picture) < 100;
  });
  return picture;
}

/// Calls send() every 100 ms, so that the stream does not stall, until wait() is fulfilled.
async function whileSending(send, wait) {
  const ticker = setInterval(send, 100);
  try {
    return await wait();
  } finally {
    clearInterval(ticker);
  }
}

// Without the answer to a key, which lies over the scene for some seconds.
const pictureOf = (page, id) => page.locator(id).screenshot({style: '#answer { visibility: hidden !important; }'});
const text = (page, id) => page.textContent(id);
const save = (page, folder, name) => folder ? page.screenshot({path: path.join(folder, `${name}.png`)}) : null;

module.exports = {changeOfScene, openPage, save, serve, settledScene, text, whileSending};
