// The tour of a simulation on the live page: its steps, and estimates beside the truth; damaged truths; `tricoil demo`.
const {spawn} = require('child_process');
const {openPage, save, text, whileSending} = require('./page_check.cjs');
const {hello, running, sample} = require('./scripted_server.cjs');

const kSteps = [
  {name: 'a hand', shows: 'A hand moves.', scenario: 'hand', compensated: true, faults: []},
  {name: 'motion error', shows: 'Columns of different times.', scenario: 'circle', compensated: false, faults: []},
  {name: 'motion compensation', shows: 'The same circle.', scenario: 'circle', compensated: true, faults: []},
  {name: 'metal', shows: 'A sphere.', scenario: 'hand', compensated: true, faults: ['metal:0.6,0.35,0,0.08']}
];
const kPlace_m = [0.4, 0.05, 0.1];
/// True pose whose x differs from kPlace_m by `mm`.
const truth = mm => [kPlace_m[0] - mm / 1000, kPlace_m[1], kPlace_m[2], 1, 0, 0, 0];

/// What the scene shows of the truth.
const drawn = page => page.evaluate(() => {
  const view = window.tricoil.scene.sensors.get(0).truth;
  const color = getComputedStyle(document.querySelector('#truth')).color.match(/\d+/g).map(v => Number(v).toString(16).padStart(2, '0')).join('');
  return {
    ghost: view.ghost.visible,
    arrow: view.arrow.visible,
    labelled: view.name.visible && view.errorName.visible && view.labelled,
    sameColor: view.shaft.material.color.getHexString() === color,
    length_mm: 1000 * (view.shaft.scale.y + view.head.scale.y)
  };
});

async function steps(browser, html, check, pictures) {
  const {server, page, errors, wait, close} = await openPage(browser, html, {viewport: {width: 640, height: 480}});
  const greet = (more = {}) => server.write(
      `data: ${JSON.stringify({hello: {...hello, source: {kind: 'simulation', tour: kSteps}, ...more}, status: running, poses: []})}\n\n`);
  let now = 1.7e12;
  let tour = null;
  /// An event with poses of 1.5 s whose error is `mm`.
  const send = (mm, count = 150) => {
    server.send(Array.from({length: count}, () => sample(0, now += 10, kPlace_m, {truth: truth(mm)})), {tour});
  };
  const begin = (step, compensated, speed = 1) => {
    tour = {step, compensated, speed};
    now += 100;
  };
  const asked = async count => {
    while (server.asked.length < count) await page.waitForTimeout(20);
    return JSON.stringify(server.asked.slice(-1));
  };
  send(0.2);
  await wait(() => window.tricoil.firstPictureMs);
  check(!await page.isVisible('#tour') && /simulation: circle/.test(await text(page, '#source')), 'without a tour there are no steps');
  greet();
  begin(1, false);
  send(3);
  await wait(() => document.querySelector('#error_without').textContent === '3.00');
  check(
      await page.locator('#tour_steps button').count() === 4 && await text(page, '#tour_text') === kSteps[1].shows &&
          await page.locator('[aria-current=step]').textContent() === '2 motion error',
      'the tour shows its steps and the sentence of this one');
  check(await text(page, '#source') === 'simulation' && await text(page, '#error_with') === '–', 'the page says that it is a simulation');
  send(3, 3);
  await wait(() => window.tricoil.scene.sensors.get(0).truth.shaft.scale.y > 0.01);
  const {length_mm, labelled, sameColor} = await drawn(page);
  check(labelled === 20 && sameColor, 'true sensor and error have labels in the scene, in the colour of the legend');
  check(
      Math.abs(length_mm - 60) < 0.01 && /true sensor . error, drawn x20/.test(await text(page, '#truth')),
      `an error of 3 mm is an arrow of ${length_mm.toFixed(1)} mm from the true sensor, and the scale is stated`);
  await page.evaluate(() => {
    const choice = document.querySelector('#error_scale');
    choice.value = '5';
    choice.dispatchEvent(new Event('change'));
  });
  send(3, 3);
  await wait(() => /x5$/.test(document.querySelector('#error_factor').textContent));
  check(Math.abs((await drawn(page)).length_mm - 15) < 0.01, 'the user changes the scale');
  await page.evaluate(() => document.querySelector('#with').click());
  check(await asked(1) === '[{"step":2,"compensated":true,"speed":1}]', 'with motion compensation the same motion has its own step');
  begin(2, true);
  send(0.25);
  await wait(() => document.querySelector('#error_with').textContent === '0.25');
  check(await text(page, '#error_without') === '3.00', 'the error before stays beside the error after: 3.00 mm, 0.25 mm');
  await save(page, pictures, 'tour');
  begin(3, true);
  send(1, 3);
  await wait(() => document.querySelector('#tour_text').textContent === 'A sphere.');
  check(
      await text(page, '#error_without') === '–' && await page.evaluate(() => window.tricoil.scene.metal.children.length) === 2 &&
          await page.isDisabled('#tour_next'),
      'another motion has its own errors; its metal is drawn');
  await page.keyboard.press('x');
  check(await asked(2) === '[{"step":3,"compensated":false,"speed":1}]', 'a key switches the compensation');
  await page.keyboard.press(',');
  check(await asked(3) === '[{"step":2,"compensated":true,"speed":1}]', 'a key leads to the step before');
  await page.keyboard.press(']');
  check(await asked(4) === '[{"step":3,"compensated":true,"speed":1.25}]', 'a key makes the hand faster');
  begin(3, true, 2);
  tour.other_mm = 7;
  send(2);
  await wait(() => document.querySelector('#error_with').textContent === '2.00');
  check(
      await text(page, '#error_without') === '7.00' && await text(page, '#hand_speed_value') === '×2' &&
          await page.inputValue('#hand_speed') === '2',
      'another speed has its own errors; a server may give the error of the other choice');

  // While poses come: a page hides the sensors of a stream that stalls.
  const isDrawn = () => window.tricoil.scene.sensors.get(0).truth.ghost.visible;
  const isNotDrawn = () => {
    const {triad, truth: {ghost, arrow}} = window.tricoil.scene.sensors.get(0);
    const {link, newest, damaged} = window.tricoil;
    return link === 'live' && newest.valid && triad.visible && !ghost.visible && !arrow.visible && damaged === 0;
  };
  const until = (condition, more, status = {tour}) =>
      whileSending(() => server.send([sample(0, now += 100, kPlace_m, more)], status), () => wait(condition));
  for (const bad of [null, [], [1, 2], [...truth(1).slice(0, 6), null], ['x', 0, 0, 1, 0, 0, 0], [0.4, 0, 0, 0, 0, 0, 0], {x: 1}]) {
    await until(isDrawn, {truth: truth(1)});
    await until(isNotDrawn, {truth: bad});
    check(true, `a truth ${JSON.stringify(bad)} is not drawn, and its pose is taken`);
  }
  greet({truth_frame: 'tracker'});
  await until(isNotDrawn, {truth: truth(1)});
  check(true, 'a truth of another frame is not drawn');
  for (const bad of [{step: 9, compensated: true}, {step: -1}, 'x', {}]) {
    await until(() => document.body.dataset.tour === 'false', {}, {tour: bad});
    await until(() => document.body.dataset.tour === 'true', {});
  }
  check(errors.length === 0, `no errors in the page ${errors.join('; ')}`);
  await close();
}

/// `tricoil demo`: the motion error without and with motion compensation.
async function demo(browser, check, program) {
  const child = spawn(program, ['demo', '--json', '--no-browser', '--step', '3600'], {stdio: ['ignore', 'pipe', 'inherit']});
  try {
    const url = await new Promise(done => child.stdout.once('data', data => done(JSON.parse(data).web)));
    const page = await browser.newPage({viewport: {width: 600, height: 500}});
    page.setDefaultTimeout(120000);
    await page.goto(url);
    await page.waitForFunction(() => document.body.dataset.tour === 'true');
    const error = async (step, id) => {
      await page.evaluate(n => document.querySelectorAll('#tour_steps button')[n].click(), step);
      await page.waitForFunction(n => window.tricoil.tour.place.step === n, step);
      await page.waitForFunction(id => /\d/.test(document.getElementById(id).textContent), id);
      return Number(await text(page, `#${id}`));
    };
    const without = await error(1, 'error_without'), compensated = await error(2, 'error_with');
    await error(1, 'error_without');
    await page.evaluate(() => {
      const slider = document.getElementById('hand_speed');
      slider.value = '2';
      slider.dispatchEvent(new Event('change'));
    });
    await page.waitForFunction(() => window.tricoil.tour.place.speed === 2 && /\d/.test(document.getElementById('error_without').textContent));
    const fast = Number(await text(page, '#error_without'));
    check(fast > 1.5 * without, `a hand twice as fast has an error of ${fast} mm, otherwise ${without} mm`);
    for (const step of [0, 3])
      check(await error(step, 'error_without') > 0.5, `step ${step + 1} shows both errors: ${await text(page, '#error_without')} mm without compensation`);
    check(without > 1 && compensated < 0.2 * without, `the demo's motion error falls from ${without} mm to ${compensated} mm`);
    for (const speed of [0, 1e9, -1, 'x', null]) {
      const ask = body => fetch('control', {method: 'POST', headers: {'Content-Type': 'application/json'}, body: JSON.stringify(body)});
      const {status} = await page.evaluate(`(${ask})(${JSON.stringify({step: 0, compensated: true, speed})}).then(({status}) => ({status}))`);
      check(status === 400, `a motion of speed ${speed} is refused`);
    }
    check(await text(page, '#source') === 'simulation', 'the demo is a simulation');
    await page.close();
  } finally {
    child.kill('SIGKILL');
  }
}

module.exports = async function pageTour(browser, html, check, pictures, program) {
  await steps(browser, html, check, pictures);
  await demo(browser, check, program);
};
