// Set-up of a device on the live page, with the commands of the program: one page at a time, wiring, calibration, pivot, surroundings, hemisphere.
const fs = require('fs');
const os = require('os');
const path = require('path');
const {save, serve, text} = require('./page_check.cjs');

const kRest = `[motion]
kind = "still"
position_m = [0.4, 0.2, 0.1]
`;

// A narrow page shows the set-up without the scene, which is rendered in software and keeps a slow machine busy.
const kNarrow = {viewport: {width: 800, height: 700}};
const kWide = {width: 1000, height: 700};

async function openSetup(browser, url, options) {
  const own = await browser.newContext(options);
  const page = await own.newPage();
  page.setDefaultTimeout(120000);  // rendered in software: on a busy machine each step may take long
  const errors = [];
  page.on('pageerror', error => errors.push(String(error)));
  await page.goto(url);
  await page.waitForFunction(() => window.tricoil?.firstPictureMs).catch(error => {
    throw new Error(`the page does not start: ${errors.join('; ')} ${error.message}`);
  });
  await page.evaluate(() => {
    const tab = document.querySelector('#tabs [data-pane=setup]');
    (tab.checkVisibility() ? tab : document.querySelector('#open_setup')).click();
  });
  const says = (id, pattern) => page.waitForFunction(
      ([id, source]) => new RegExp(source).test(document.querySelector(id).textContent), [id, pattern.source]);
  return {own, page, errors, says};
}

async function wiring(browser, program, folder, check, pictures) {
  const scenario = path.join(folder, 'rest.toml');
  fs.writeFileSync(scenario, kRest);
  const server = await serve(program, 0, ['--scenario', scenario, '--record-folder', path.join(folder, 'rest')]);
  const {own, page, errors, says} = await openSetup(browser, server.web_controls, kNarrow);
  await says('#setup_device', /connected/);
  await says('#setup_coils', /Source coils: current found; sensor 1 found, \d+ dB/);
  check(true, `device and coils are named: ${await text(page, '#setup_device')} ${await text(page, '#setup_coils')}`);
  await page.click('#find_devices');
  await says('#setup_found', /No CAN interface|:/);
  await page.click('#check_machine');
  await says('#setup_found', /passed|udev|:/);
  check(true, `the computer is checked: ${(await text(page, '#setup_found')).slice(0, 60)}`);
  await page.fill('#at_y', 'two');
  await page.click('#check_wiring');
  await says('#setup_wiring', /must be numbers/);
  await page.fill('#at_y', '400');
  await page.click('#check_wiring');
  await says('#setup_wiring', /several wirings give the same couplings/);
  check(true, `a bad direction is refused: ${await text(page, '#setup_wiring')}`);
  await page.fill('#at_y', '200');
  await page.click('#check_wiring');
  await says('#setup_wiring', /The wiring is straight/);
  check(true, 'the wiring of the simulation is straight');

  const second = await openSetup(browser, server.web_controls, kNarrow);
  await second.says('#setup_note', /another page sets up this device; close the set-up there first/);
  check(
      await second.page.isDisabled('#check_wiring') && await second.page.isDisabled('#start_motion'),
      `a second page is refused: ${await text(second.page, '#setup_note')}`);
  await page.keyboard.press('s');  // closes it
  await page.waitForFunction(() => document.querySelector('#setup').hidden);
  await second.page.click('#setup_note button');
  await second.page.waitForFunction(() => !document.querySelector('#check_wiring').disabled);
  check(true, 'the second page goes on when the first one has closed its set-up');
  await page.keyboard.press('s');
  await says('#setup_note', /another page/);
  await second.own.close();
  await page.waitForTimeout(1200);  // until the server has noticed
  await page.click('#setup_note button');
  await page.waitForFunction(() => !document.querySelector('#check_wiring').disabled);
  check(true, 'a page that is closed leaves the set-up to others');

  const watching = await openSetup(browser, server.web, kNarrow);
  check(/link with the token/.test(await text(watching.page, '#setup_note')) && await watching.page.isDisabled('#check_wiring'), 'without the token there is no set-up');
  await watching.own.close();
  await page.waitForFunction(() => document.body.dataset.usable === 'true');
  await page.setViewportSize(kWide);
  await page.click('#choose_side');
  await page.waitForFunction(() => document.querySelectorAll('#setup_sides button').length === 2);
  await page.waitForTimeout(500);
  await save(page, pictures, 'set-up-hemisphere');
  const place = await page.evaluate(() => {
    const {hemisphere, view} = window.tricoil.scene, canvas = document.querySelector('#scene');
    const p = hemisphere.balls[1].position.clone().project(view.camera), {left, top} = canvas.getBoundingClientRect();
    return [left + (p.x + 1) / 2 * canvas.clientWidth, top + (1 - p.y) / 2 * canvas.clientHeight];
  });
  await page.mouse.click(...place);
  await page.waitForFunction(() => window.tricoil.newest.position_m[0] < 0);
  check(/Set, and used now/.test(await text(page, '#setup_hemisphere')), 'a click on the other place in the picture sets the hemisphere');
  check(errors.length === 0, `no errors in the page ${errors.join('; ')}`);
  await own.close();
  server.end();
}

async function calibration(browser, program, folder, check, pictures) {
  const server = await serve(program, 0, ['--scenario', 'hand', '--speed', '3', '--record-folder', path.join(folder, 'hand')]);
  const {own, page, errors, says} = await openSetup(browser, server.web_controls, pictures ? {viewport: {width: 1400, height: 900}} : kNarrow);
  await page.fill('#constant', '-1');
  await page.click('#start_motion');
  await says('#setup_calibration', /must be a number above 0/);
  await page.fill('#constant', '7.02e-3');
  await page.click('#start_motion');
  await says('#setup_calibration', /Sensor around the source: \d+ %, missing: .*Distances/);
  await page.waitForFunction(() => document.querySelectorAll('#coverage .full').length > 5);
  check(await page.isDisabled('#check_wiring') && await page.isDisabled('#start_pivot'), 'other steps wait meanwhile');
  await page.waitForTimeout(8000);
  await save(page, pictures, 'set-up');
  check(true, `the coverage tells what is missing: ${await text(page, '#setup_calibration')}`);
  await page.click('#start_motion');
  await says('#setup_calibration', /\d+ column frames, unexplained .* Start again with --calibration setup-free-motion-.*free-motion.toml/);
  check(true, `the calibration is made: ${await text(page, '#setup_calibration')}`);
  const name = fs.readdirSync(path.join(folder, 'hand'))[0];
  const toml = fs.readFileSync(path.join(folder, 'hand', name, 'free-motion.toml'), 'utf8');
  check(/hemisphere/.test(toml), 'its file is in the folder of the recording');
  await page.click('#start_surroundings');
  await page.waitForTimeout(1500);
  await page.click('#start_surroundings');
  await says('#setup_surroundings', /Distortion .* mm RMS, most .*No metal that disturbs/);
  check(true, `surroundings: ${await text(page, '#setup_surroundings')}`);
  await page.click('#start_pivot');
  await page.waitForTimeout(1500);
  await page.click('#start_pivot');
  await says('#setup_pivot', /residual|tip|tilt/);
  check(true, `a hand is no pivot: ${await text(page, '#setup_pivot')}`);
  await page.click('#start_motion');
  await page.waitForFunction(() => window.tricoil.status.recording);
  await page.keyboard.press('s');
  await page.waitForFunction(() => !window.tricoil.status.recording);
  check(true, 'closing the set-up ends its recording');
  check(errors.length === 0, `no errors in the page ${errors.join('; ')}`);
  await own.close();
  const phone = await openSetup(browser, server.web_controls, {viewport: {width: 390, height: 844}, isMobile: true, hasTouch: true});
  await phone.page.click('#tabs [data-pane=setup]');
  await phone.page.waitForFunction(() => !document.querySelector('#check_wiring').disabled);
  check(await phone.page.evaluate(() => document.documentElement.scrollWidth <= innerWidth), 'the set-up fits the screen of a phone');
  await save(phone.page, pictures, 'set-up-phone');
  await phone.own.close();
  server.end();
}

module.exports = async function pageSetup(browser, html, check, pictures, program) {
  const folder = fs.mkdtempSync(path.join(os.tmpdir(), 'tricoil_setup_'));
  try {
    for (const name of ['rest', 'hand']) fs.mkdirSync(path.join(folder, name));
    await wiring(browser, program, folder, check, pictures);
    await calibration(browser, program, folder, check, pictures);
  } finally {
    fs.rmSync(folder, {recursive: true, force: true});
  }
};
