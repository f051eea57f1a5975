// Plays a recording: the poses of all sensors at a time that runs, stops and jumps.
import {levelOf} from './quality.js';
import {settings} from './settings.js';
import {kBeside, TrackedSensor} from './state.js';

const kTrail_s = 10;
const kBack_s = 0.5, kRestart_s = 1;  // a larger step back of the time is a restart of the device, shown as a gap of a second

class PlayedSensor extends TrackedSensor {
  constructor(number, poses) {
    super(number, poses.length * 2 + 16);
    this.poses = [];
    let shift = 0;  // of the axis, because the device was restarted
    for (const pose of poses) {
      if (this.poses.length && pose.time_s + shift < this.poses.at(-1).t - kBack_s) shift = this.poses.at(-1).t + kRestart_s - pose.time_s;
      const t = pose.time_s + shift;
      if (this.history.add(pose, t, levelOf(pose, settings.limit_mm))) this.poses.push({...pose, t});
    }
  }

  /// Becomes the sensor `number`, `by` seconds later.
  move(number, by) {
    this.number = number;
    for (const pose of this.poses) pose.t += by;
    this.history.shift(by);
  }

  /// Number of poses up to time t.
  count(t) {
    let low = 0, high = this.poses.length;
    while (low < high) {
      const middle = (low + high) >> 1;
      if (this.poses[middle].t <= t)
        low = middle + 1;
      else
        high = middle;
    }
    return low;
  }

  /// Newest pose at time t; before the first one, the first.
  at(t) { return this.poses[Math.max(0, this.count(t) - 1)]; }

  /// Poses on the trail at time t.
  trail(t) { return this.poses.slice(this.count(t - kTrail_s), this.count(t)); }
}

export class Player {
  /// poses: of parseRecording, at least one.
  constructor(name, poses, note) {
    this.name = name;
    this.note = note;
    this.beside = null;  // name of the recording that is compared
    this.sensors = new Map();
    for (const number of [...new Set(poses.map(pose => pose.sensor))].sort()) {
      this.sensors.set(number, new PlayedSensor(number, poses.filter(pose => pose.sensor === number)));
    }
    const all = [...this.sensors.values()];
    this.from = Math.min(...all.map(sensor => sensor.poses[0].t));
    this.to = this.ownEnd = Math.max(...all.map(sensor => sensor.poses.at(-1).t));
    this.speed = 1;
    this.playing = true;
    this.seek(this.from);
  }

  /// Shows another recording beside this one. Both begin at the same time.
  compare(name, poses) {
    for (const number of [...this.sensors.keys()].filter(number => number >= kBeside)) this.sensors.delete(number);
    const other = new Player(name, poses, '');
    const by = this.from - other.from;
    for (const [number, sensor] of other.sensors) {
      sensor.move(number + kBeside, by);
      this.sensors.set(sensor.number, sensor);
    }
    this.beside = name;
    this.to = Math.max(this.ownEnd, other.to + by);
    this.seek(this.t);
  }

  /// Jumps to time t. The trails then have to be drawn again.
  seek(t) {
    this.t = Math.max(this.from, Math.min(t, this.to));
    this.jumped = true;
    this.#place();
  }

  /// dt: time (s) that has passed since the last call.
  advance(dt) {
    if (!this.playing) return;
    this.t = Math.min(this.t + dt * this.speed, this.to);
    if (this.t === this.to) this.playing = false;
    this.#place();
  }

  toggle() {
    if (!this.playing && this.t === this.to) this.seek(this.from);
    this.playing = !this.playing;
  }

  #place() {
    for (const sensor of this.sensors.values()) sensor.newest = sensor.at(this.t);
  }
}
