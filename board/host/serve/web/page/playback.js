// Playback of recordings: list, loading, time line.
import {headers} from './controls.js';
import {bands} from './decimate.js';
import {linked, setLink} from './link.js';
import {palette} from './palette.js';
import {Player} from './player.js';
import {isReady, parseRecording} from './recording_text.js';
import {server} from './server.js';
import {page} from './state.js';
import {make} from './tools.js';

const element = id => document.getElementById(id);
const clock = s => `${Math.floor(s / 60)}:${(s % 60).toFixed(1).padStart(4, '0')}`;
const size = bytes => bytes < 1e6 ? `${Math.ceil(bytes / 1e3)} kB` : `${(bytes / 1e6).toFixed(1)} MB`;
const kBandColors = {
  1: 'caution',
  2: 'bad',
  3: 'muted'
};

export class Playback {
  /// section: list of recordings. changed(): playback began or ended. say(text): shows a failure.
  constructor(section, changed, say) {
    this.section = section;
    this.changed = changed;
    this.say = say;
    this.file =
        make('input', {type: 'file', accept: '.csv,text/csv', id: 'file', ariaLabel: 'Open a file of poses', onchange: () => this.openFile()});
    this.list = make('table');
    section.append(make('h2', {}, 'Recordings'), this.list, make('p', {}, make('label', {}, 'Open poses.csv of a recording: ', this.file)));
    element('play').addEventListener('click', () => this.toggle());
    element('leave').addEventListener('click', () => this.leave());
    element('position').addEventListener('input', event => {
      page.playback.seek(page.playback.from + Number(event.target.value));
    });
    element('position').addEventListener('change', () => this.#link());
    element('speed').addEventListener('change', event => {
      page.playback.speed = Number(event.target.value);
    });
  }

  /// Asks the server for its recordings.
  async refresh() {
    const note = text => this.list.replaceChildren(make('tr', {}, make('td', {}, text)));
    try {
      const response = await server.request('recordings', {headers: headers()});
      const answer = await response.json();
      if (!response.ok) return note(answer.answer);
      const rows = answer.recordings.map(
          ({name, bytes, complete}) => make(
              'tr', {}, make('td', {}, name), make('td', {}, `${size(bytes)}${complete ? '' : ', incomplete'}`),
              make(
                  'td', {}, make('button', {onclick: () => this.open(name)}, 'Play'), ' ',
                  make(
                      'button', {className: 'beside', title: 'Show it beside the recording that plays', onclick: () => this.compare(name)},
                      'Beside'))));
      if (rows.length === 0) return note('none yet');
      this.list.replaceChildren(...rows);
    } catch {
      note('Server not reachable.');
    }
  }

  /// t: of the moment, in s since the start, that is shown; null: plays from the start.
  async open(name, t = null) {
    const text = await this.#load(name);
    if (text !== null) this.start(name, text, {t});
  }

  /// Shows a recording beside the one that plays.
  async compare(name) {
    const text = await this.#load(name);
    if (text === null || !page.playback) return;
    const {poses, errors} = parseRecording(text);
    if (poses.length === 0) return this.say(`${name}: ${errors.join(' ')}`);
    page.playback.compare(name, poses);
    this.say(`${name} is dashed in the plots; its sensors are B1, B2 and so on. ${errors.join(' ')}`);
    this.#showSpan();
  }

  /// Text of a recording; null if it cannot be read, which is said.
  async #load(name) {
    this.say(`Loading ${name}.`);
    try {
      const response = await server.request(`recordings/${encodeURIComponent(name)}`, {headers: headers()});
      if (response.ok) return await response.text();
      this.say((await response.json()).answer);
    } catch {
      this.say(`${name}: the server ended before the recording was complete.`);
    }
    return null;
  }

  async openFile() {
    const [file] = this.file.files;
    if (file) this.start(file.name, await file.text(), {isLocal: true});
    this.file.value = '';
  }

  /// text: content of the recording. A damaged one is refused, or played as far as it goes, with a note.
  start(name, text, {t = null, isLocal = false} = {}) {
    if (!isReady()) return this.say('Wait until the page is connected: the names of the flags come from the server.');
    const {poses, errors} = parseRecording(text);
    if (poses.length === 0) return this.say(`${name}: ${errors.join(' ')}`);
    page.playback = new Player(name, poses, errors.join(' '));
    this.isLocal = isLocal;
    if (isLocal) setLink(null);
    if (t !== null) {
      page.playback.playing = false;
      this.seek(page.playback.from + t);
    }
    this.say(errors.length ? `${name}: ${errors.join(' ')}` : `Playing ${name}.`);
    element('speed').value = '1';
    this.#showSpan();
  }

  #showSpan() {
    element('position').max = String(page.playback.to - page.playback.from);
    this.paintStrip();
    this.changed();
    element('play').focus();
  }

  leave() {
    if (!page.playback) return;
    page.playback = null;
    setLink(null);
    this.changed();
  }

  toggle() {
    page.playback.toggle();
    this.#link();
  }

  /// Jumps to time t.
  seek(t) {
    page.playback.seek(t);
    this.#link();
  }

  /// Opens what the address names, once the page is connected. isNew: the address has changed.
  openLink(isNew = false) {
    const moment = linked();
    if (!moment || !isReady()) return;
    if (page.playback?.name !== moment.name)
      this.open(moment.name, moment.t);
    else if (isNew)
      this.seek(page.playback.from + moment.t);
  }

  async copyLink() {
    if (this.isLocal) return this.say('A file of this computer has no link.');
    this.#link();
    try {
      await navigator.clipboard.writeText(location.href);
      this.say('Link to this moment copied.');
    } catch {
      this.say('The address of this page leads to this moment.');
    }
  }

  #link() {
    if (!this.isLocal) setLink(page.playback.name, page.playback.t - page.playback.from);
  }

  /// dt: seconds since the last call.
  advance(dt) {
    const player = page.playback;
    player.advance(dt);
    element('play').textContent = player.playing ? 'Pause' : 'Play';
    element('play_time').textContent = `${clock(player.t - player.from)} / ${clock(player.to - player.from)}`;
    element('play_name').textContent = player.name + (player.beside ? `, beside ${player.beside}` : '') + (player.note ? ` ▲ ${player.note}` : '');
    if (document.activeElement !== element('position') || player.playing) element('position').value = String(player.t - player.from);
    element('position').setAttribute('aria-valuetext', `${(player.t - player.from).toFixed(1)} s`);
  }

  /// Faults of the chosen sensor below the time line.
  paintStrip() {
    const {from, to} = page.playback;
    const share = t => `${(100 * (t - from) / Math.max(to - from, 1e-9)).toFixed(2)}%`;
    const stops = bands(page.chosen?.history ?? [...page.playback.sensors.values()][0].history, from, to).map(band => {
      const color = palette[kBandColors[band.level]];
      return `var(--line) ${share(band.from)}, ${color} ${share(band.from)} ${share(band.to)}, var(--line) ${share(band.to)}`;
    });
    element('strip').style.setProperty('--strip', stops.length ? `linear-gradient(90deg, ${stops.join(', ')})` : 'var(--line)');
  }
}
