// Live page: receives poses as a stream, draws scene and plots, sends control requests by POST.
import {conjugate, eulerAngles, product} from './attitude.js';
import {exaggerationFor, kSigmas} from './ellipsoid.js';
import {History} from './history.js';
import {Plots} from './plots.js';
import {Scene} from './scene.js';
import {connect} from './stream.js';
import {token} from './token.js';

const kRefreshMs = 250;  // redraw interval without new poses

const element = id => document.getElementById(id);
const plots = new Plots(element('plots'));
let scene = null;
let sceneRequested = false;
let exaggeration = 1;

/// State of the page. sensors: Map from sensor number to {newest, heardMs, history, boresight}.
const page = {
  poses: 0, firstPoseMs: null, firstPictureMs: null, status: {}, sensors: new Map(), selected: null,
  get newest() { return chosen()?.newest ?? null; },
  get boresight() { return chosen()?.boresight ?? null; },
  get exaggeration() { return exaggeration; },
};
window.tricoil = page;  // for tests

function chosen() { return page.sensors.get(page.selected); }

function sensor(number) {
  if (!page.sensors.has(number)) {
    page.sensors.set(number, {newest: null, heardMs: 0, history: new History(), boresight: null});
    page.selected ??= number;
    const numbers = [...page.sensors.keys()].sort();
    element('sensor').replaceChildren(...numbers.map(n => new Option(String(n + 1), String(n), false, n === page.selected)));
    element('sensors').hidden = numbers.length < 2;
  }
  return page.sensors.get(number);
}

function select(number) {
  if (!page.sensors.has(number)) return;
  page.selected = number;
  element('sensor').value = String(number);
  showChosen();
}

const isLive = () => document.body.dataset.link === 'live';
const isGood = tracked => isLive() && tracked.newest.valid && !tracked.newest.stale;
const turned = tracked => tracked.boresight ? product(tracked.newest.q_wxyz, conjugate(tracked.boresight)) : tracked.newest.q_wxyz;

/// Processes a pose of any sensor.
function take(pose) {
  const tracked = sensor(pose.sensor);
  const begins = tracked.history.breaksWith(pose);
  tracked.newest = pose;
  if (!pose.stale) {  // a stale pose repeats an earlier one
    tracked.heardMs = performance.now();
    tracked.history.add(pose);
  }
  if (pose.sensor === page.selected && pose.valid) exaggeration = exaggerationFor(pose.position_covariance_m2, exaggeration);
  scene?.sensor(pose.sensor).show(pose, turned(tracked), exaggeration, begins);
}

function showChosen() {
  const tracked = chosen();
  if (!tracked) return;
  const pose = tracked.newest;
  const mm = pose.position_m.map(v => (1000 * v).toFixed(1).padStart(8));
  const angles = eulerAngles(turned(tracked)).map(v => v.toFixed(2).padStart(8));
  element('numbers').textContent =
    `x ${mm[0]} mm  azimuth   ${angles[0]}°\ny ${mm[1]} mm  elevation ${angles[1]}°\nz ${mm[2]} mm  roll      ${angles[2]}°`;
  document.body.dataset.pose = isGood(tracked) ? 'good' : 'bad';
  element('state').textContent = isLive() && !pose.stale ? pose.state_name : '';
  element('flags').textContent = isLive() ? [pose.flag_names, pose.advice].filter(Boolean).join(': ') : '';
  if (scene) element('ellipsoid').textContent = `${kSigmas} sigma ellipsoid, drawn x${exaggeration}`;
  plots.draw(tracked.history, pose.utc_ms / 1000 + (performance.now() - tracked.heardMs) / 1000);
}

/// Creates the 3D view. Called after the first numbers and plots are painted, because it can take a second without a graphics processor.
function openScene() {
  try {
    scene = new Scene(element('scene'));
    page.firstPictureMs = performance.now();
  } catch {
    element('ellipsoid').textContent = 'no 3D view: this browser does not support WebGL';
  }
}

function afterPaint(action) {
  requestAnimationFrame(() => setTimeout(action));
}

function receive(message) {
  page.status = message.status;
  element('run').textContent = message.status.running ? 'Stop' : 'Start';
  element('record').textContent = message.status.recording ? 'End recording' : 'Record';
  element('recording_error').textContent = message.status.recording_error;
  allowControls(message.status.controls);
  showHealth(message.status.health);
  for (const pose of message.poses) {
    ++page.poses;
    take(pose);
  }
  showChosen();
  if (page.newest && page.firstPoseMs === null) afterPaint(() => { page.firstPoseMs ??= performance.now(); });
  if (!sceneRequested) afterPaint(openScene);
  sceneRequested = true;
}

/// Warnings as text; otherwise the share of missing columns, and the temperature if the device measures it.
function showHealth(health) {
  const output = element('health');
  output.dataset.warning = String(health.warning !== '');
  const temperature = health.temperature_c === null ? '' : `, ${health.temperature_c.toFixed(0)} °C`;
  const text = health.warning || `${health.missing_percent.toFixed(1)} % missing${temperature}`;
  if (output.textContent !== text) output.textContent = text;
  output.title = Object.entries(health).map(([key, value]) => `${key}: ${value}`).join('\n');
}

function link(state) {
  document.body.dataset.link = state;
  element('link').textContent = state === 'live' ? 'live' : state === 'silent' ? 'no poses' : 'reconnecting';
  if (state !== 'live') {
    for (const view of scene?.sensors.values() ?? []) view.setVisible(false);
  }
  showChosen();
}

/// controls: 'open' (for everyone), 'token' (for clients with the token), 'none'.
function allowControls(controls) {
  const allowed = controls === 'open' || (controls === 'token' && token() !== null);
  for (const id of ['run', 'set', 'record', 'button', 'hemisphere']) element(id).disabled = !allowed;
  element('access').textContent = allowed ? '' : controls === 'none' ? 'read only' : 'read only; for controls, open the link with the token (printed by tricoil serve, or in its --token-file)';
}

async function ask(request) {
  const answer = element('answer');
  try {
    const headers = {'Content-Type': 'application/json'};
    if (token()) headers.Authorization = `Bearer ${token()}`;
    const response = await fetch('control', {method: 'POST', headers, body: JSON.stringify(request)});
    answer.textContent = (await response.json()).answer;
  } catch {
    answer.textContent = 'server not reachable';
  }
}

function setBoresight(q) {
  if (chosen()) chosen().boresight = q;
}

const actions = {
  run: () => ask({run: !page.status.running}),
  set: () => ask({hemisphere: element('hemisphere').value.split(',').map(Number), sensor: page.selected ?? 0}),
  boresight: () => setBoresight(page.newest?.q_wxyz),
  unboresight: () => setBoresight(null),
  record: () => ask({record: !page.status.recording}),
  button: () => ask({button: 'click'}),
};
for (const [id, action] of Object.entries(actions)) element(id).addEventListener('click', action);
element('sensor').addEventListener('change', event => select(Number(event.target.value)));
const keys = {' ': 'run', h: 'set', b: 'boresight', u: 'unboresight', r: 'record', p: 'button'};
document.addEventListener('keydown', event => {
  const typing = ['SELECT', 'BUTTON'].includes(event.target.tagName) && event.key === ' ';
  if (keys[event.key] && !event.repeat && !typing && !event.ctrlKey && !event.metaKey && !event.altKey) {
    event.preventDefault();
    if (!element(keys[event.key]).disabled) actions[keys[event.key]]();
  }
});
setInterval(() => { if (!isLive()) showChosen(); }, kRefreshMs);
connect(receive, link);
