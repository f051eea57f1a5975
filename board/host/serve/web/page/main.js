// Live page: receives poses as a stream, and shows them in scene, numbers and plots.
import {kConventions, relative} from './attitude.js';
import {agrees, ask, mayControl, recordOrEnd, say, showPermission, startOrStop} from './controls.js';
import {historyCsv, save} from './csv.js';
import {kSigmas} from './ellipsoid.js';
import {Guide} from './guide.js';
import {fillHelp, listen} from './keys.js';
import {Levels} from './levels.js';
import {errorGradient, readPalette} from './palette.js';
import {Playback} from './playback.js';
import {PlotDialog} from './plot_dialog.js';
import {Plots} from './plots.js';
import {qualityOf, sidesOf} from './quality.js';
import {Readout} from './readout.js';
import {flags, learn} from './sample.js';
import {Scene} from './scene.js';
import {describe} from './scene_text.js';
import {SetUp} from './setup.js';
import {kScales, kUnits, onSystemTheme, set, settings} from './settings.js';
import {besideOf, nameOf, page, take} from './state.js';
import {showHealth, showRecording, showSource} from './status.js';
import {connect} from './stream.js';
import {Tools} from './tools.js';
import {Tour} from './tour.js';
import {Work} from './work.js';

const kRefreshMs = 100;  // redraw interval without new poses
const kLinkNames = {
  live: 'live',
  silent: 'no poses',
  stalled: 'stream stalls',
  down: 'reconnecting',
  connecting: 'connecting'
};

const element = id => document.getElementById(id);
readPalette();
element('scale').style.setProperty('--gradient', errorGradient());
const plots = new Plots(element('plots'), {
  changed: showPause,
  edit: index => plotDialog.open(index),
  pick: t => {
    if (page.playback) playback.seek(t);
  },
  read: text => {
    element('reading').textContent = text;
  }
});
const plotDialog = new PlotDialog(() => {
  plots.rebuild();
  showChosen();
});
const readout = new Readout();
const guide = new Guide(towards => ask({hemisphere: towards, sensor: page.selected ?? 0}));
const tools = new Tools(element('tools'), say);
const levels = new Levels(element('tools'));
const playback = new Playback(tools.recordings, showMode, say);
const setup = new SetUp(element('setup'), {
  shown: () => {
    element('open_setup').setAttribute('aria-expanded', String(!element('setup').hidden));
    if (!element('setup').hidden) showTools(false);
  },
  choose: on => {
    const pane = document.body.dataset.pane;
    if (on && pane === 'setup') showPane('scene');
    if (!on && pane === 'scene' && matchMedia('(max-width: 900px)').matches && !element('setup').hidden) showPane('setup');
    if (!page.shown.size) return;
    placeSensors();
    if (on) page.scene?.view.fit([...knownPositions(), ...knownPositions().map(p => p.map(v => -v))]);
  }
});
const tour = page.tour = new Tour(element('tour'), request => ask(request, true), beginStep);
const kLegendGap = 16;  // pixels
const kAreaMs = 500;
const kStill_px = 5;  // a longer way of the pointer turns the picture
const work = page.work = new Work();
let sceneRequested = false;
let isFitted = false;  // the camera shows this run

const inOrder = () => [...page.shown.keys()].sort((a, b) => a - b);

function listSensors() {
  const numbers = inOrder();
  if (!numbers.includes(page.selected)) page.selected = numbers[0] ?? null;
  element('sensor').replaceChildren(...numbers.map(n => new Option(nameOf(n), String(n), false, n === page.selected)));
  element('sensors').hidden = numbers.length < 2;
}

function select(number) {
  if (!page.shown.has(number)) return;
  page.selected = number;
  element('sensor').value = String(number);
  plots.drawnMs = 0;
  levels.show();
  if (page.playback) playback.paintStrip();
  showChosen();
}

const isLive = () => page.link === 'live' || page.playback !== null;

/// Shows the newest pose of the chosen sensor.
function showChosen() {
  const tracked = page.chosen;
  const pose = tracked?.newest ?? null;
  const status = page.playback ? {running: true} : page.status;
  const quality = qualityOf({link: page.playback ? 'live' : page.link, status, pose, limit_mm: settings.limit_mm, cameBack: tracked?.wasTracked});
  guide.show(quality, pose, mayControl() && !page.playback);
  const usable = isLive() && pose !== null && pose.valid;
  document.body.dataset.usable = String(usable);
  element('state').textContent = isLive() && pose && !pose.names.includes('stale') ? flags.states[pose.state] ?? '' : '';
  element('flags').textContent = isLive() && pose ? `Flags of the newest pose: ${pose.names.join(', ') || 'none'}.` : '';
  if (!pose) return;
  document.body.dataset.truth = String(pose.truth !== null);
  if (pose.truth) plots.showTruth();
  readout.show(tracked);
  const here = ['localhost', '127.0.0.1', '[::1]'].includes(location.hostname);
  readout.showTiles(tracked, page.playback ? null : page.latency_ms ?? null, isLive());
  element('latency').title = here ? '' : 'without the network';
  element('error_factor').textContent = `x${settings.error_scale}`;
  if (page.scene) element('ellipsoid').textContent = `ellipsoid: ${kSigmas} × expected error, drawn x${settings.error_scale}`;
  const now = page.playback ? page.playback.t : tracked.now();
  const beside = page.playback ? page.shown.get(besideOf(tracked.number))?.history ?? null : null;
  plots.draw(tracked.history, now, page.playback ? page.playback.from : plots.frozen ? plots.origin : now, beside);
}

/// Moves the sensors in the scene to their newest poses.
function placeSensors() {
  if (!page.scene) return;
  for (const [number, tracked] of page.shown) {
    const view = page.scene.sensor(number);
    view.show(tracked.newest, relative(tracked.newest.q_wxyz, tracked.boresight), settings.error_scale);
    if (!isLive()) view.setVisible(false);
  }
  const pose = page.newest;
  const unknown = isLive() && pose?.names.includes('hemisphere_unknown') && Number.isFinite(pose.position_m[0]);
  const asks = unknown || (setup.choosing && isLive() && Number.isFinite(pose?.position_m[0]));
  page.scene.hemisphere.show(pose?.position_m, asks ? sidesOf(pose.position_m) : []);
  follow();
  page.scene.hemisphere.confine(page.playback || tour.place || unknown ? null : page.status.confined_to?.[page.selected] ?? null);
  describe(element('scene'), [...page.shown.values()], isLive(), tour.metal);
  page.scene.invalidate();
}

function drawTrails() {
  for (const view of page.scene?.sensors.values() ?? []) {
    view.clearTrails();
    if (!page.shown.has(view.number)) view.setVisible(false);
  }
  if (!page.playback || !page.scene) return;
  for (const [number, sensor] of page.playback.sensors) {
    let before = null;
    for (const pose of sensor.trail(page.playback.t)) {
      if (pose.valid) page.scene.sensor(number).add(pose, settings.error_scale, !before?.valid || pose.t - before.t > 0.3);
      before = pose;
    }
  }
}

/// Another run of the tour began.
function beginStep() {
  drawTrails();
  page.scene?.showMetal(tour.metal);
  isFitted = false;
}

const knownPositions = () => [...page.shown.values()].map(tracked => tracked.newest).filter(pose => pose?.valid).map(pose => pose.position_m);
/// Positions on the trails.
const recentPositions = () => [...page.scene.sensors.values()].flatMap(({trail}) => trail.points.filter((_, n) => n % 20 === 0).map(({p}) => p));

let area = null, areaMs = 0;
/// Part of the scene that no text covers. Measured rarely, because the browser then computes the layout.
function freeArea() {
  if (!area || performance.now() - areaMs > kAreaMs) area = measureArea();
  return area;
}

function measureArea() {
  areaMs = performance.now();
  const {clientWidth: width, clientHeight: height} = element('scene');
  const numbers = element('numbers'), legend = element('legend');
  const top = (numbers.offsetTop + numbers.offsetHeight) / height, bottom = 1 - (legend.offsetHeight + kLegendGap) / height;
  return bottom - top > 0.3 && width > 0 ? {left: 0.02, right: 0.98, top, bottom} : {left: 0, right: 1, top: 0, bottom: 1};
}

/// Keeps the sensors in sight: fits at the start of a run, and while the user does not move the camera.
function follow() {
  const now = knownPositions();
  if (!page.scene || now.length === 0) return;
  if (!isFitted)
    page.scene.view.fit([...now, ...metalPlaces()]);
  else
    page.scene.view.follow(now, () => [...recentPositions(), ...metalPlaces()]);
  isFitted = true;
}

const metalPlaces = () => tour.metal.map(({position_m}) => position_m);

function showFollowing() { element('follow').setAttribute('aria-pressed', String(page.scene?.view.following ?? true)); }

function toggleFollow() {
  if (!page.scene) return;
  if (page.scene.view.following)
    page.scene.view.stay();
  else
    page.scene.view.following = true;
  isFitted &&= !page.scene.view.following;
  showFollowing();
  follow();
}

/// Creates the 3D view. Called after the first numbers and plots are painted, because it can take a second without a graphics
/// processor.
function openScene() {
  try {
    page.scene = new Scene(element('scene'), {freeArea, taken: showFollowing, measure: ms => work.end(ms)});
    showUp();
    page.scene.showMetal(tour.metal);
    placeSensors();
    page.firstPictureMs = performance.now();
  } catch {
    element('ellipsoid').textContent = 'no 3D view: this browser does not support WebGL';
  }
}

/// Shows one of the views, and follows.
function resetView(name) {
  if (!page.scene) return;
  page.scene.view.turn(name);
  page.scene.view.following = true;
  isFitted = false;
  showFollowing();
  page.scene.view.fit([...knownPositions(), ...recentPositions(), ...metalPlaces()]);
}

function showUp() {
  element('axis').textContent = settings.up === 'down' ? 'z points down, as of a FASTRAK' : 'z points up';
  if (!page.scene) return;
  page.scene.setUp(settings.up === 'down' ? -1 : 1);
  showField();
  page.scene.showMetal(tour.metal);
  isFitted = false;
}

const fieldShown = () => settings.field !== 'auto' ? settings.field : tour.place ? 'all' : 'none';
function showField() {
  element('field').value = fieldShown();
  if (page.scene && page.scene.fieldAxis !== fieldShown()) page.scene.showField(fieldShown());
}

function afterPaint(action) { requestAnimationFrame(() => setTimeout(action)); }

/// Processes an event of the stream. Returns true if it has a new pose.
function receive(message) {
  if (message.hello) greet(message.hello);
  const recordingChanged = page.status.recording !== message.status.recording;
  page.status = message.status;
  if (message.status.levels) levels.take(message.status.levels);
  showStatus();
  if (recordingChanged && !element('tools').hidden) playback.refresh();
  const jumps = page.clockJumps;
  let fresh = false;
  for (const values of message.poses) {
    const taken = take(values, () => {
      if (!page.playback) listSensors();
    });
    if (!taken) continue;
    const {tracked, begins} = taken;
    const pose = tracked.newest;
    fresh ||= taken.fresh;
    if (tracked.number === page.selected && taken.fresh) tour.add(pose, pose.t);
    if (!pose.valid || page.playback) continue;
    page.scene?.sensor(tracked.number).add(pose, settings.error_scale, begins);
    if (tracked.number !== page.selected) continue;
    tools.collect(pose);
    setup.collect(pose);
  }
  const newest = page.sensors.get(page.selected)?.newest;
  if (newest && fresh) page.latency_ms = page.status.now_ms - newest.utc_ms;
  tour.refresh();
  if (page.clockJumps > jumps && !tour.place) say('The clock of the device jumped. The plots continue without a break.');
  if (page.playback) return fresh;
  placeSensors();
  showChosen();
  if (page.newest && page.firstPoseMs === null)
    afterPaint(() => {
      page.firstPoseMs ??= performance.now();
    });
  if (!sceneRequested) afterPaint(openScene);
  sceneRequested = true;
  return fresh;
}

function greet(hello) {
  showSource(hello.source);
  page.outdated = !learn(hello);
  setup.greet(hello.page);
  tour.begin(hello.source?.tour);
  playback.openLink();
}

function showStatus() {
  element('run').textContent = page.status.running ? 'Stop' : 'Start';
  element('record').textContent = page.status.recording ? 'End recording' : 'Record';
  const problem = page.outdated ? 'The server was replaced by another version: reload this page.' : page.status.recording_error;
  if (element('problem').textContent !== problem) element('problem').textContent = problem;
  tour.show(page.status.tour);
  showField();
  showRecording(page.status);
  showPermission();
  showHealth(page.status.health, page.damaged + page.stream.damaged);
}

function link(state) {
  page.link = document.body.dataset.link = state;
  levels.show();
  showMode();
}

/// Live or playback.
function showMode() {
  document.body.dataset.mode = page.playback ? 'playback' : 'live';
  element('link').textContent = page.playback ? 'playback' : kLinkNames[page.link];
  element('playback').hidden = !page.playback;
  const shown = `${page.playback?.name} ${page.playback?.beside}`;
  if (document.body.dataset.shown !== shown) {
    document.body.dataset.shown = shown;
    plots.showRecording(page.playback && {from: page.playback.from, to: page.playback.to});
    listSensors();
    drawTrails();
    if (page.playback) {
      playback.paintStrip();
      resetView('free');
      if (playedMs === null) requestAnimationFrame(play);
    }
  }
  if (page.shown.size) placeSensors();
  showChosen();
}

let playedMs = null;
function play(ms) {
  if (!page.playback) {
    playedMs = null;
    return;
  }
  work.time(() => {
    playback.advance(playedMs === null ? 0 : Math.min(0.25, (ms - playedMs) / 1000));
    drawTrails();
    placeSensors();
    showChosen();
  });
  playedMs = ms;
  requestAnimationFrame(play);
}

/// The newest time; in playback about the present moment.
function showWindow() {
  if (page.playback)
    plots.freeze(page.playback.t - settings.window_s / 2, page.playback.t + settings.window_s / 2);
  else
    plots.follow();
}

function showPause() {
  const paused = plots.frozen !== null;
  element('pause').setAttribute('aria-pressed', String(paused));
  element('pause').textContent = page.playback ? 'Whole' : paused ? 'Follow' : 'Pause';
  element('pause').disabled = page.playback !== null && !paused;
}

function setBoresight(q) {
  const tracked = page.chosen;
  if (!tracked) return;
  if (q && document.body.dataset.usable === 'false') return say('No valid pose for a boresight.');
  tracked.boresight = q;
  tracked.applyTurn();
  plots.drawnMs = 0;
  placeSensors();
  say(q ? `Boresight of sensor ${tracked.number + 1}: on this page only. Other pages and programs keep their attitudes.` :
          `Boresight of sensor ${tracked.number + 1} cleared.`);
  showChosen();
}

function saveShown() {
  const tracked = page.chosen;
  if (!tracked) return;
  const {from, to} = plots.shown;
  save(`tricoil-sensor${tracked.number + 1}.csv`, historyCsv(tracked.history, from, to, tracked.number + 1, kConventions[settings.order].names));
}

function applyConventions() {
  for (const tracked of new Set([...page.sensors.values(), ...page.shown.values()])) tracked.applyTurn();
  readout.showConventions();
  plots.rebuild();
  tools.show();
  showChosen();
}

function applyTheme() {
  readPalette();
  page.scene?.setTheme();
  page.scene?.showMetal(tour.metal);
  plots.rebuild();
  if (page.playback) playback.paintStrip();
  if (page.scene && page.shown.size) placeSensors();
  showChosen();
}

async function setLimit() {
  element('limit_value').value = String(settings.limit_mm);
  if (!await agrees(element('limit_dialog'))) return;
  set('limit_mm', Number(element('limit_value').value));
  plots.rebuild();
  showChosen();
}

function toggleTools() { showTools(element('tools').hidden); }

function showTools(shown) {
  element('tools').hidden = !shown;
  element('open_tools').setAttribute('aria-expanded', String(shown));
  if (shown) {
    if (!setup.isBusy) setup.close();
    playback.refresh();
    levels.show();
  }
}

/// Opens the tools at the levels, or closes them.
function toggleLevels() {
  if (matchMedia('(max-width: 900px)').matches)
    showPane('tools');
  else
    toggleTools();
  if (!element('tools').hidden) levels.focus();
}

/// A narrow screen shows one part of the page: scene, plots, tools or controls.
function showPane(name) {
  document.body.dataset.pane = name;
  for (const button of document.querySelectorAll('[data-pane]:not(body)')) button.setAttribute('aria-pressed', String(button.dataset.pane === name));
  showTools(name === 'tools');
  if (name === 'setup')
    setup.open();
  else if (!setup.isBusy)
    setup.close();
  plots.drawnMs = 0;
  showChosen();
}

/// Shows or hides a group that a narrow screen hides.
function toggleGroup(button) {
  const shown = document.body.dataset[button.dataset.toggle] !== 'true';
  document.body.dataset[button.dataset.toggle] = String(shown);
  button.setAttribute('aria-expanded', String(shown));
}

function setField(axis) {
  set('field', axis);
  showField();
}

/// Binds a choice to a setting. apply(): shows the change.
function bind(id, name, apply, convert = String) {
  element(id).value = String(settings[name]);
  element(id).addEventListener('change', event => {
    set(name, convert(event.target.value));
    apply();
  });
}

const next = (values, value) => values[(values.indexOf(value) + 1) % values.length];
const cycleTheme = () => {
  set('theme', next(['auto', 'light', 'dark'], settings.theme));
  element('theme').value = settings.theme;
  applyTheme();
};
const actions = {
  run: startOrStop,
  record: recordOrEnd,
  button: () => ask({button: 'click'}),
  set: () => ask({hemisphere: element('hemisphere').value.split(',').map(Number), sensor: page.selected ?? 0}),
  boresight: () => setBoresight(page.newest?.q_wxyz),
  unboresight: () => setBoresight(null),
  point: () => tools.capture(),
  average: () => tools.captureAverage(),
  open_tools: toggleTools,
  open_levels: toggleLevels,
  open_setup: () => setup.toggle(),
  pause: () => plots.frozen ? plots.follow() : plots.pause(),
  closer: () => plots.zoom(0.5),
  wider: () => plots.zoom(2),
  csv: saveShown,
  help: () => element('help_dialog').showModal(),
  limit: setLimit,
  copy_link: () => playback.copyLink(),
  new_plot: () => plotDialog.open(),
  follow: toggleFollow,
};
for (const [id, action] of Object.entries(actions)) element(id).addEventListener('click', () => action());
for (const button of document.querySelectorAll('[data-view]')) button.addEventListener('click', () => resetView(button.dataset.view));
for (const button of document.querySelectorAll('[data-pane]:not(body)')) button.addEventListener('click', () => showPane(button.dataset.pane));
for (const button of document.querySelectorAll('[data-toggle]')) button.addEventListener('click', () => toggleGroup(button));
const pressed = id => () => {
  if (!element(id).disabled) actions[id]();
};
listen({
  ' ': () => page.playback ? playback.toggle() : pressed('run')(),
  h: pressed('set'),
  b: pressed('boresight'),
  u: pressed('unboresight'),
  r: pressed('record'),
  p: pressed('button'),
  c: pressed('point'),
  v: pressed('average'),
  t: pressed('open_tools'),
  l: pressed('open_levels'),
  s: pressed('open_setup'),
  k: pressed('pause'),
  '+': pressed('closer'),
  '-': pressed('wider'),
  e: pressed('csv'),
  '?': pressed('help'),
  0: () => resetView('free'),
  1: () => resetView('top'),
  2: () => resetView('front'),
  3: () => resetView('side'),
  f: pressed('follow'),
  g: () => setField(next(['none', 'x', 'y', 'z', 'all'], fieldShown())),
  m: cycleTheme,
  '.': () => tour.move(1),
  ',': () => tour.move(-1),
  x: () => tour.toggle(),
  '[': () => tour.hasten(-1),
  ']': () => tour.hasten(1),
  n: () => select(next(inOrder(), page.selected)),
  Escape: () => playback.leave()
});

// A side of the source is chosen in the picture.
let pressedAt = [0, 0];
element('scene').addEventListener('pointerdown', ({offsetX, offsetY}) => {
  pressedAt = [offsetX, offsetY];
}, true);
element('scene').addEventListener('click', ({offsetX, offsetY}) => {
  if (!page.scene || page.playback || Math.hypot(offsetX - pressedAt[0], offsetY - pressedAt[1]) > kStill_px) return;
  const towards = page.scene.hemisphere.sideAt(offsetX, offsetY, element('scene'), page.scene.view.camera);
  if (towards && setup.choosing)
    setup.chooseSide(towards);
  else if (towards && mayControl())
    guide.answer(towards);
});

element('error_scale').append(...kScales.map(scale => new Option(`×${scale}`, String(scale))));
element('units').append(...Object.keys(kUnits).map(name => new Option(name, name)));
element('order').append(...Object.entries(kConventions).map(([name, {label}]) => new Option(label, name)));
bind('units', 'units', applyConventions);
bind('order', 'order', applyConventions);
bind('theme', 'theme', applyTheme);
bind('window', 'window_s', showWindow, Number);
bind('error_scale', 'error_scale', () => page.shown.size && placeSensors(), Number);
element('field').addEventListener('change', event => setField(event.target.value));
bind('up', 'up', () => {
  showUp();
  if (page.shown.size) placeSensors();
});
element('sensor').addEventListener('change', event => select(Number(event.target.value)));
onSystemTheme(applyTheme);
for (const button of document.querySelectorAll('[data-cancel]')) button.addEventListener('click', () => button.closest('dialog').close('no'));
fillHelp(element('help_text'));
readout.showConventions();
setInterval(() => {
  if (!isLive()) showChosen();
}, kRefreshMs);
page.plots = plots;
addEventListener('hashchange', () => playback.openLink(true));
connect(message => work.time(() => receive(message)), link, page.stream);
