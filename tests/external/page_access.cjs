// The live page for people with weak eyes, a finger, a keyboard or a screen reader.
const {openPage} = require('./page_check.cjs');
const {sample} = require('./scripted_server.cjs');

const kLeastText_px = 12, kLeastTarget_px = 24;

/// Visible texts that are smaller than kLeastText_px; a size of 0 hides a text whose control says the same.
const smallTexts = page => page.evaluate(least => {
  const walker = document.createTreeWalker(document.body, NodeFilter.SHOW_TEXT);
  const found = [];
  while (walker.nextNode()) {
    const {parentElement: part, textContent} = walker.currentNode;
    if (!textContent.trim() || !part.checkVisibility() || ['SCRIPT', 'STYLE'].includes(part.tagName)) continue;
    const px = parseFloat(getComputedStyle(part).fontSize);
    if (px > 0 && px < least) found.push(`${part.id || part.tagName} ${textContent.trim().slice(0, 20)} ${px}`);
  }
  return found;
}, kLeastText_px);

const smallTargets = page => page.$$eval(
    'button, select, input:not([type=checkbox]), label:has(input[type=checkbox])',
    (parts, least) => parts.filter(part => part.checkVisibility())
                          .map(part => [part, part.getBoundingClientRect()])
                          .filter(([, {width, height}]) => Math.min(width, height) < least)
                          .map(([part, {width, height}]) => `${part.id || part.textContent} ${width} x ${height}`),
    kLeastTarget_px);

/// Counts what a screen reader would speak.
const listen = page => page.evaluate(() => {
  window.spoken = [];
  const live =
      [...document.querySelectorAll('output, [role=status], [role=alert], [aria-live]')].filter(part => part.getAttribute('aria-live') !== 'off');
  const watch = new MutationObserver(changes => {
    for (const {target} of changes) {
      const part = live.find(part => part.contains(target));
      if (part) window.spoken.push(`${part.id}: ${part.textContent}`);
    }
  });
  watch.observe(document.body, {subtree: true, childList: true, characterData: true});
});

/// What a screen reader speaks while action() runs. A busy machine may stall the stream for a moment, which is spoken, too: then it begins again.
async function spokenDuring(page, action) {
  for (let tries = 0; tries < 20; ++tries) {
    await page.waitForFunction(() => document.body.dataset.link === 'live' && document.body.dataset.quality === 'good');
    await page.waitForTimeout(1000);
    await page.evaluate(() => {
      window.spoken = [];
    });
    await action();
    const spoken = await page.evaluate(() => window.spoken);
    if (!spoken.some(text => text.startsWith('link'))) return spoken;
  }
  throw new Error('the stream stalls again and again');
}

module.exports = async function pageAccess(browser, html, check) {
  for (const [width, height] of [[1400, 900], [390, 844]]) {
    const {server, page, errors, wait, close} = await openPage(browser, html, {viewport: {width, height}});
    let now = 1.7e12, x = 0.4, more = {}, health = 0;
    const ticker = setInterval(
        () => server.send(
            [sample(0, now += 100, [x += 1e-3, 0, 0.1], more)],
            {health: {warning: '', missing_percent: ++health % 3 / 10, temperature_c: 40 + health % 4}}),
        100);
    await wait(() => window.tricoil.firstPictureMs && document.querySelector('#announcement').textContent);
    const labels = await page.evaluate(() => {
      const {scene} = window.tricoil, heights = [];
      scene.scene.traverse(part => {
        if (part.isSprite)
          heights.push(
              part.scale.y * scene.height /
              (2 * Math.tan(scene.view.camera.fov * Math.PI / 360) *
               part.getWorldPosition(part.position.clone()).distanceTo(scene.view.camera.position)));
      });
      return Math.min(...heights);
    });
    check(labels > 17, `${width}: the letters of the scene have 12 px: labels of ${labels.toFixed(0)} px`);
    for (const pane of width < 901 ? ['scene', 'plots', 'tools', 'setup', 'controls'] : ['t', 's']) {
      if (width < 901)
        await page.click(`#tabs [data-pane=${pane}]`);
      else
        await page.keyboard.press(pane);
      const texts = await smallTexts(page), targets = await smallTargets(page);
      check(texts.length === 0, `${width} ${pane}: no text is smaller than ${kLeastText_px} px ${texts}`);
      check(targets.length === 0, `${width} ${pane}: no target is smaller than ${kLeastTarget_px} px ${targets}`);
    }
    if (width < 901) await page.click('#tabs [data-pane=plots]');
    await page.click('#new_plot');
    const inDialog = [...await smallTexts(page), ...await smallTargets(page)];
    check(inDialog.length === 0, `${width}: nor in the dialog of plots ${inDialog}`);
    await page.keyboard.press('Escape');
    await page.focus('#plots figure');
    await page.keyboard.press('Home');
    const first = await page.evaluate(() => document.querySelector('#reading').textContent);
    await page.keyboard.press('ArrowRight');
    const second = await page.evaluate(() => document.querySelector('#reading').textContent);
    check(/^position at −\d+\.\d s: x \d+\.\d, y 0\.0, z 100\.0 mm$/.test(first) && second !== first, `keys read the plots: ${first}; ${second}`);

    await listen(page);
    const calm = await spokenDuring(page, () => page.waitForTimeout(3000));
    check(calm.length === 0, `${width}: while all is well a screen reader is silent ${calm.slice(0, 3)}`);
    const spoken = await spokenDuring(page, async () => {
      more = {flags: ['low_signal']};
      await wait(() => /too weak/.test(document.querySelector('#announcement').textContent));
      await page.waitForTimeout(1500);
      more = {};
    });
    check(
        spoken.length === 1 && /^announcement: Sensor 1: not usable. Signal too weak/.test(spoken[0]),
        `${width}: a change of the quality is read once: ${spoken}`);
    check(errors.length === 0, `no errors in the page ${errors.join('; ')}`);
    clearInterval(ticker);
    await close();
  }
};
