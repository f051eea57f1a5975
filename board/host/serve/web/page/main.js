// The live page: one stream of poses in, a picture and plots out; wishes go back by POST.
import {connect} from './stream.js';
import {Scene} from './scene.js';
import {Plots} from './plots.js';

const element = id => document.getElementById(id);
const plots = new Plots(element('plots'));
const page = {poses: 0, firstPoseMs: null, firstPictureMs: null, newest: null, boresight: null, status: {}};
let scene = null;
let wanted = false;  // the scene
window.tricoil = page;  // for tests

function conjugate([w, x, y, z]) { return [w, -x, -y, -z]; }
function product([a, b, c, d], [e, f, g, h]) {
  return [a*e - b*f - c*g - d*h, a*f + b*e + c*h - d*g, a*g - b*h + c*e + d*f, a*h + b*g - c*f + d*e];
}

/// Azimuth, elevation and roll in degrees, as core/geometry has them.
function eulerAngles([w, x, y, z]) {
  const degrees = 180 / Math.PI;
  return [Math.atan2(2*(x*y + w*z), 1 - 2*(y*y + z*z)), Math.asin(Math.max(-1, Math.min(1, 2*(w*y - x*z)))),
          Math.atan2(2*(y*z + w*x), 1 - 2*(x*x + y*y))].map(a => a * degrees);
}

function show(pose) {
  const q = page.boresight ? product(pose.q, conjugate(page.boresight)) : pose.q;
  const mm = pose.p.map(v => (1000 * v).toFixed(1).padStart(8));
  const angles = eulerAngles(q).map(v => v.toFixed(2).padStart(8));
  element('numbers').textContent =
    `x ${mm[0]} mm  azimuth   ${angles[0]}°\ny ${mm[1]} mm  elevation ${angles[1]}°\nz ${mm[2]} mm  roll      ${angles[2]}°`;
  element('state').textContent = pose.state;
  element('flags').textContent = pose.flags;
  scene?.show(pose, q);
}

/// Last, as a picture in space may take a second to begin where the processor draws it; numbers and plots do without.
function openScene() {
  try {
    scene = new Scene(element('scene'));
    page.firstPictureMs = performance.now();
  } catch {
    element('ellipsoid').textContent = 'no picture in space: this browser has no WebGL';
  }
}

function afterPaint(action) {
  requestAnimationFrame(() => setTimeout(action));
}


function receive(message) {
  page.status = message.status;
  element('run').textContent = message.status.running ? 'Stop' : 'Start';
  element('record').textContent = message.status.recording ? 'End recording' : 'Record';
  for (const pose of message.poses) {
    ++page.poses;
    page.newest = pose;
    plots.add(pose);
  }
  if (page.newest) {
    show(page.newest);
    plots.draw();
    if (page.firstPoseMs === null) afterPaint(() => { page.firstPoseMs ??= performance.now(); });
  }
  if (!wanted) afterPaint(openScene);
  wanted = true;
}

function link(state) {
  document.body.dataset.link = state;
  element('link').textContent = state === 'live' ? 'live' : state === 'silent' ? 'no poses' : 'reconnecting';
}

async function ask(wish) {
  const answer = element('answer');
  try {
    const response = await fetch('control', {method: 'POST', headers: {'Content-Type': 'application/json'}, body: JSON.stringify(wish)});
    answer.textContent = (await response.json()).answer;
  } catch {
    answer.textContent = 'not reached';
  }
}

const actions = {
  run: () => ask({run: !page.status.running}),
  set: () => ask({hemisphere: element('hemisphere').value.split(',').map(Number), sensor: page.newest?.sensor ?? 0}),
  boresight: () => { page.boresight = page.newest && page.newest.q; },
  unboresight: () => { page.boresight = null; },
  record: () => ask({record: !page.status.recording}),
};
for (const [id, action] of Object.entries(actions)) element(id).addEventListener('click', action);
const keys = {' ': 'run', h: 'set', b: 'boresight', u: 'unboresight', r: 'record'};
document.addEventListener('keydown', event => {
  const typing = ['SELECT', 'BUTTON'].includes(event.target.tagName) && event.key === ' ';
  if (keys[event.key] && !typing && !event.ctrlKey && !event.metaKey && !event.altKey) {
    event.preventDefault();
    actions[keys[event.key]]();
  }
});
connect(receive, link);
