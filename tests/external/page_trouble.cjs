// The live page with a server in trouble: it dies, stalls, sends damaged messages, or its clock jumps.
const {openPage, text, whileSending} = require('./page_check.cjs');
const {hello, running, sample} = require('./scripted_server.cjs');

module.exports = async function pageTrouble(browser, html, check) {
  const {server, page, errors, wait, close} = await openPage(browser, html);
  let utc = 1.7e12;
  const send = count => {
    for (let n = 0; n < count; ++n, utc += 33) server.send([sample(0, utc, [0.4, 0, 0.1])]);
  };
  const history = () => page.evaluate(() => {
    const {length, times} = window.tricoil.sensors.get(0).history;
    const steps = [...times.subarray(1, length)].map((t, n) => t - times[n]);
    return {length, longest: Math.max(...steps), shortest: Math.min(...steps)};
  });
  const untilGood = () => whileSending(() => send(1), () => wait(() => window.tricoil.firstPictureMs && document.body.dataset.quality === 'good'));
  await untilGood();

  for (const [jump, what] of [[-3_600_000, 'back by an hour'], [3_600_000, 'forward by an hour']]) {
    const before = await history();
    utc += jump;
    send(30);
    await wait(count => window.tricoil.sensors.get(0).history.length >= count, before.length + 30);
    const {length, longest, shortest} = await history();
    check(
        shortest > 0 && longest < 60 && /clock of the device jumped/.test(await text(page, '#answer')),
        `a clock that jumps ${what} loses no pose: ${length} poses, longest step ${longest.toFixed(2)} s`);
  }

  const wrong = [...sample(0, utc, [0.4, 0, 0.1])];
  wrong[5] = null;
  const status =
      {running: true, recording: false, recording_error: '', controls: 'open', health: {warning: '', missing_percent: 0, temperature_c: null}};
  for (const bad
           of ['not json', '{"status":', '[]', 'null', '{}', '{"status":{},"poses":3}', JSON.stringify({status, poses: [wrong, [1, 2], 'x', null]})])
    server.write(`data: ${bad}\n\n`);
  send(5);
  await wait(() => /10 damaged messages/.test(document.querySelector('#health').textContent));
  await untilGood();
  check(true, 'damaged messages are counted, and the page goes on');

  await wait(() => document.body.dataset.link === 'stalled');
  check(
      /The stream stalls/.test(await text(page, '#reason')) && await page.evaluate(() => document.body.dataset.usable) === 'false',
      'a stream that stalls is told, and its values are grey');
  await untilGood();
  check(true, 'a stream that goes on is live again');

  server.close();
  await wait(() => document.body.dataset.link === 'down');
  check(
      /Server not reachable/.test(await text(page, '#reason')) && await page.evaluate(() => document.body.dataset.quality) === 'off',
      'a server that dies is told');
  await page.keyboard.press('h');
  await wait(() => /not reachable; nothing was changed/.test(document.querySelector('#answer').textContent));
  const kept = (await history()).length;
  await server.listen();
  while (!server.connected()) await page.waitForTimeout(50);
  await untilGood();
  check((await history()).length > kept, 'after the restart the page is live again, and keeps its history');
  const columns = [...hello.columns.slice(1), 'sensor'];
  server.write(`data: ${JSON.stringify({hello: {...hello, columns}, status: running, poses: []})}\n\n`);
  await wait(() => /replaced by another version: reload this page/.test(document.querySelector('#problem').textContent));
  server.write(`data: ${JSON.stringify({hello, status: running, poses: []})}\n\n`);
  await wait(() => document.querySelector('#problem').textContent === '');
  check(true, 'a page that a newer server does not know asks to be loaded again');
  check(errors.length === 0, `no errors in the page ${errors.join('; ')}`);
  await close();
};
