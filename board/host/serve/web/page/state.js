// State of the page: sensors, their histories, and the newest status of the server.
import {History} from './history.js';
import {levelOf} from './quality.js';
import {decode} from './sample.js';
import {settings} from './settings.js';
import {Timeline} from './timeline.js';

export const kBeside = 10;  // first number of the sensors of a second recording
export const nameOf = number => number < kBeside ? String(number + 1) : `B${number - kBeside + 1}`;
/// Number of the same sensor in the other recording.
export const besideOf = number => number < kBeside ? number + kBeside : number - kBeside;

/// Data of one sensor.
export class TrackedSensor {
  constructor(number, most) {
    this.number = number;
    this.newest = null;  // pose, with its time t on the axis
    this.heardMs = 0;
    this.history = new History(most);
    this.boresight = null;  // attitude that reads zero, on this page only
    this.wasTracked = false;
    this.history.setTurn(this.turn);
  }

  get turn() { return {order: settings.order, boresight: this.boresight}; }
  applyTurn() { this.history.setTurn(this.turn); }

  /// Time on the axis now: of the newest pose, plus the time since it arrived.
  now() { return (this.newest?.t ?? 0) + (performance.now() - this.heardMs) / 1000; }
}

const timeline = new Timeline();

export const page = {
  poses: 0,
  damaged: 0,
  firstPoseMs: null,
  firstPictureMs: null,
  link: 'connecting',
  status: {},
  sensors: new Map(),
  selected: null,
  playback: null,
  scene: null,
  stream: {damaged: 0},
  outdated: false,
  tour: null,
  work: null,
  plots: null,
  get shown() { return this.playback?.sensors ?? this.sensors;},
  get chosen() { return this.shown.get(this.selected) ?? null;},
  get newest() { return this.chosen?.newest ?? null;},
  get boresight() { return this.chosen?.boresight ?? null;},
  get clockJumps() { return timeline.jumps;},
};
window.tricoil = page;  // for tests

/// Adds one pose in compact form. Returns {tracked, begins, fresh}, or null if it is damaged. begins: it does not continue the
/// pose before. fresh: it is not a repetition. added(): a sensor is new.
export function take(values, added) {
  const pose = decode(values);
  if (!pose) {
    ++page.damaged;
    return null;
  }
  if (!page.sensors.has(pose.sensor)) {
    page.sensors.set(pose.sensor, new TrackedSensor(pose.sensor));
    added();
  }
  ++page.poses;
  const tracked = page.sensors.get(pose.sensor);
  const before = tracked.newest;
  // A stale pose repeats an earlier one, unless the device measures that there is no sensor.
  const stale = pose.names.includes('stale') && !(pose.names.includes('no_sensor') && pose.time_s > (before?.time_s ?? -Infinity));
  if (stale && before) {
    tracked.newest = {...pose, t: before.t};
    return {tracked, begins: true, fresh: false};
  }
  const heard = performance.now();
  const t = timeline.at(pose.sensor, pose.time_s, heard / 1000);
  const begins = !before?.valid || tracked.history.breaksAt(t);
  tracked.history.add(pose, t, levelOf(pose, settings.limit_mm));
  tracked.newest = {...pose, t};
  tracked.heardMs = heard;
  tracked.wasTracked ||= pose.valid;
  return {tracked, begins, fresh: !stale};
}
