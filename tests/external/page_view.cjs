// The view of the live page: source and sensor are in the picture, errors keep their scale, a narrow screen shows what matters first.
const {openPage, save, text, whileSending} = require('./page_check.cjs');
const {hello, running, sample} = require('./scripted_server.cjs');

const kPlaces_m = [[0.4, 0, 0.1], [1.2, 0.3, -0.2], [0.1, -0.6, 0.3], [-0.5, 0.2, 0.1], [0.3, 0.9, 0.4]];
const kTour = [{name: 'metal', shows: 'A sphere.', scenario: 'hand', compensated: true, faults: ['metal:0.6,0.35,0,0.08']}];

/// Places of source and sensor in the picture, 0 to 1, and the part that the numbers cover.
const places = page => page.evaluate(() => {
  const {scene, newest} = window.tricoil;
  const place = p => {
    const {x, y} = scene.sensors.get(0).triad.position.clone().set(...p).project(scene.view.camera);
    return [(x + 1) / 2, (1 - y) / 2];
  };
  const numbers = document.querySelector('#numbers'), {clientHeight} = document.querySelector('#scene');
  return {source: place([0, 0, 0]), sensor: place(newest.position_m), covered: (numbers.offsetTop + numbers.offsetHeight) / clientHeight};
});
/// Widths of the trail at its points, pixels; 0 at a point from which the sensor did not move.
const trailWidths = page => page.evaluate(() => {
  const {scene} = window.tricoil;
  scene.draw();  // with the present camera
  const {points, geometry: {attributes, drawRange}} = scene.sensors.get(0).trail;
  const {clientWidth, clientHeight} = scene.canvas;
  const place = n => scene.view.camera.position.clone().fromBufferAttribute(attributes.position, n).project(scene.view.camera);
  return points.slice(0, drawRange.count / 6).map((_, n) => {
    const [a, b] = [place(2 * n), place(2 * n + 1)];
    return Math.hypot((a.x - b.x) * clientWidth / 2, (a.y - b.y) * clientHeight / 2);
  });
});
const isInside = ({source, sensor, covered}) => [source, sensor].every(([x, y]) => x > 0.02 && x < 0.98 && y > covered && y < 0.98);
const shown = all => JSON.stringify(all, (_, v) => typeof v === 'number' ? Math.round(100 * v) / 100 : v);

async function inThePicture(browser, html, check, pictures) {
  for (const [width, height] of [[1400, 900], [390, 844]]) {
    const {server, page, errors, wait, close} = await openPage(browser, html, {viewport: {width, height}});
    let now = 1.7e12, place = kPlaces_m[0];
    const during = wait => whileSending(() => server.send([sample(0, now += 100, place)]), wait);
    const settled = () => during(async () => {
      await wait(x => window.tricoil.newest?.position_m[0] === x && window.tricoil.scene, place[0]);
      await page.waitForTimeout(300);
      await wait(() => window.tricoil.scene.view.goal === null);
      return places(page);
    });
    for (place of kPlaces_m) {
      const found = await settled();
      check(isInside(found), `${width}: source and sensor at ${place} are in the picture ${shown(found)}`);
    }
    const widths = (await trailWidths(page)).filter(v => v !== 0);
    check(
        widths.length >= kPlaces_m.length - 1 && widths.every(v => Math.abs(v - 3.5) < 0.05),
        `${width}: the trail has its width where the sensor moved ${shown(widths)}`);
    await save(page, pictures, `view-${width}`);
    const box = await page.locator('#scene').boundingBox();
    await during(async () => {
      await page.mouse.move(box.x + box.width / 2, box.y + box.height * 0.7);
      await page.mouse.down();
      await page.mouse.move(box.x + box.width / 2 + 60, box.y + box.height * 0.7, {steps: 3});
      await page.mouse.up();
    });
    check(await page.getAttribute('#follow', 'aria-pressed') === 'false', `${width}: a user who turns the view has the camera`);
    place = [4, 4, 0.1];
    check(!isInside(await settled()), `${width}: the view then stays`);
    await page.keyboard.press('f');
    check(isInside(await settled()), `${width}: and follows on request`);
    check(errors.length === 0, `no errors in the page ${errors.join('; ')}`);
    await close();
  }
}

async function errorsAndAxes(browser, html, check) {
  const {server, page, errors, wait, close} = await openPage(browser, html);
  let now = 1.7e12, more = {};
  const during = wait => whileSending(() => server.send([sample(0, now += 100, kPlaces_m[0], more)], {tour: more.tour ?? null}), wait);
  const reach = () => page.evaluate(() => Math.max(...window.tricoil.scene.sensors.get(0).ellipsoid.matrix.elements.slice(0, 3)));
  await during(() => wait(() => window.tricoil.firstPictureMs));
  const before = await reach();
  more = {covariance: [1e-6, 0, 0, 4e-6, 0, 4e-6]};
  await during(() => wait(() => window.tricoil.newest.covariance[0] === 1e-6));
  check(
      Math.abs(await reach() / before - 10) < 1e-3 && /drawn x20$/.test(await text(page, '#ellipsoid')),
      'an ellipsoid of ten times the deviation is ten times as large');
  await during(async () => {
    await page.selectOption('#error_scale', '50');
    await wait(() => /drawn x50$/.test(document.querySelector('#ellipsoid').textContent));
  });
  check(Math.abs(await reach() / before - 25) < 1e-2, 'the user changes the scale');

  const height = () => page.evaluate(() => window.tricoil.scene.view.camera.position.z);
  check(/z points down/.test(await text(page, '#axis')) && await height() < 0, 'the page says that z points down');
  await during(() => page.selectOption('#up', 'up'));
  check(
      /z points up/.test(await text(page, '#axis')) && await height() > 0 && await page.evaluate(() => window.tricoil.newest.position_m[2]) === 0.1,
      'z can point up; the numbers stay');
  check(await page.evaluate(() => window.tricoil.scene.field.children.length) === 0, 'without a demo there are no field lines at first');
  server.write(`data: ${JSON.stringify({hello: {...hello, source: {kind: 'simulation', tour: kTour}}, status: running, poses: []})}\n\n`);
  more = {tour: {step: 0, compensated: true}};
  await during(() => wait(() => document.body.dataset.tour === 'true' && document.querySelector('#field').value === 'all'));
  const faint = await page.evaluate(() => window.tricoil.scene.field.children.map(lines => lines.material.opacity));
  check(faint.length === 3 && faint.every(v => v < 0.2), `the demo has faint field lines of each coil: ${faint}`);
  await during(() => page.selectOption('#field', 'none'));
  check(await page.evaluate(() => window.tricoil.scene.field.children.length) === 0, 'the user switches them off');

  await page.focus('#scene');
  const camera = () => page.evaluate(() => window.tricoil.scene.view.camera.position.toArray());
  const old = await camera();
  await page.keyboard.press('ArrowLeft');
  const turned = await camera();
  await page.keyboard.press('+');
  const nearer = await camera();
  const move = (a, b) => Math.hypot(...a.map((v, k) => v - b[k]));
  check(
      move(old, turned) > 0.05 && move(turned, nearer) > 0.05 && await page.getAttribute('#pause', 'aria-pressed') === 'false',
      'keys turn and zoom the scene');
  await during(
      () =>
          wait(() => /Sensor 1: x 400.0, y 0.0, z 100.0 mm, 412.3 from the source, expected error/.test(document.querySelector('#scene').ariaLabel)));
  check(true, `the scene has a text: ${await page.getAttribute('#scene', 'aria-label')}`);
  const ms = await page.evaluate(() => window.tricoil.work.mean_ms);
  check(ms > 0, `the page counts its script: ${ms.toFixed(1)} ms a frame`);  // depends on the machine, so printed but not checked
  check(errors.length === 0, `no errors in the page ${errors.join('; ')}`);
  await close();
}

async function narrow(browser, html, check, pictures) {
  const {server, page, errors, wait, close} = await openPage(browser, html, {viewport: {width: 390, height: 844}});
  let now = 1.7e12;
  const during = wait => whileSending(() => server.send([sample(0, now += 100, kPlaces_m[0])], {controls: 'token'}), wait);
  await during(
      () => wait(() => window.tricoil.firstPictureMs && document.body.dataset.quality === 'good' && document.querySelector('#access').textContent));
  /// Parts that are not wholly on the screen.
  const cut = selector => page.$$eval(
      selector,
      parts => parts.filter(part => part.checkVisibility())
                   .map(part => [part, part.getBoundingClientRect()])
                   .filter(([, {left, right, top, bottom}]) => left < 0 || right > innerWidth || top < 0 || bottom > innerHeight)
                   .map(([part]) => part.id || part.textContent));
  for (const pane of ['scene', 'plots', 'tools', 'controls']) {
    await during(() => page.click(`#tabs [data-pane=${pane}]`));
    const lost =
        await cut('#p0, #p2, #word, #reason, header button, #tabs button, nav button, nav select, #views button, #plot_bar button, #plot_bar select');
    check(lost.length === 0, `390, ${pane}: no button is cut, position and quality are above the fold ${lost}`);
    await save(page, pictures, `narrow-${pane}`);
  }
  check(await page.isVisible('#p0') && await page.isVisible('#run'), '390: position and controls are seen together');
  await during(() => page.click('#tabs [data-pane=plots]'));
  check(await page.isVisible('#plots canvas') && !await page.isVisible('#scene'), '390: one tap leads to the plots');
  await page.setViewportSize({width: 1400, height: 900});
  const header = await page.$$eval(
      'header > *',
      parts => parts.filter(part => part.checkVisibility() && part.offsetWidth)
                   .map(part => part.getBoundingClientRect())
                   .map(({top, bottom, right}) => [(top + bottom) / 2, right]));
  check(
      Math.max(...header.map(([y]) => y)) - Math.min(...header.map(([y]) => y)) < 12 && Math.max(...header.map(([, x]) => x)) <= 1400 &&
          /read only/.test(await text(page, '#access')),
      '1400: the header is one line, with a long text too');
  check(await page.isVisible('#plots canvas') && await page.isVisible('#scene'), '1400: scene and plots are beside each other');
  check(errors.length === 0, `no errors in the page ${errors.join('; ')}`);
  await close();
}

module.exports = async function pageView(browser, html, check, pictures) {
  await inThePicture(browser, html, check, pictures);
  await errorsAndAxes(browser, html, check);
  await narrow(browser, html, check, pictures);
};
