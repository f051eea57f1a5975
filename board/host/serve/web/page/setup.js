// Set-up of a device: what is connected, side of the source, wiring, calibration from free motion, metal nearby, tip of a pointer.
// Recordings are made with the switch of the page; commands of the server work on them. One page at a time sets up a device.
import {ask, headers, mayControl, say} from './controls.js';
import {Coverage} from './coverage.js';
import {sidesOf} from './quality.js';
import {server} from './server.js';
import {page} from './state.js';
import {make} from './tools.js';

const kWiring_ms = 2000;  // of rest
const kRefreshMs = 250;
const element = id => document.getElementById(id);

/// Number of a field, in its unit; NaN if it is empty or no number.
const numberIn = field => field.value.trim() === '' ? NaN : Number(field.value.replace(',', '.'));
const stamp = () => new Date().toISOString().slice(0, 19).replace(/[-:]/g, '').replace('T', '-');
const lastLine = text => text.trim().split('\n').at(-1).replace(/^tricoil: /, '');
const percent = share => `${(100 * share).toPrecision(2)} %`;

export class SetUp {
  /// shown(): the panel was opened or closed. choose(on): shows the two places of the sensor in the picture, to choose from.
  constructor(panel, {shown, choose}) {
    this.panel = panel;
    this.shown = shown;
    this.choose = choose;
    this.number = null;   // of this page, at the server
    this.holds = false;   // this page sets up the device
    this.motion = null;   // of the running step: {step, coverage, name}
    this.running = null;  // AbortController of a command
    this.choosing = false;
    this.note = make('p', {id: 'setup_note', role: 'status'});
    this.steps = make('div', {id: 'setup_steps'});
    panel.append(make('h2', {}, 'Set-up'), this.note, this.steps);
    this.#build();
    setInterval(() => this.refresh(), kRefreshMs);
  }

  #build() {
    const text = (id, ...words) => make('p', {id, role: 'status'}, ...words);
    const button = (id, words, onclick) => make('button', {id, onclick}, words);
    const field = (id, label, value, title) => make('label', {}, label, ' ', make('input', {id, value, title, size: 5, autocomplete: 'off'}));
    const step = (name, what, ...parts) => this.steps.append(make('section', {ariaLabel: name}, make('h3', {}, name), make('p', {}, what), ...parts));
    step(
        '1 Device and coils', '', text('setup_device'), text('setup_coils'), button('find_devices', 'Find devices', () => this.findDevices()), ' ',
        button('check_machine', 'Check this computer', () => this.checkComputer()), text('setup_found'));
    step(
        '2 Wiring', 'Rest the sensor at this position, its axes parallel to those of the source, away from axes and diagonals.',
        make('p', {className: 'fields'}, field('at_x', 'x', '400'), field('at_y', 'y', '200'), field('at_z', 'z', '100'), 'mm'),
        button('check_wiring', 'Check', () => this.checkWiring()), text('setup_wiring'));
    step(
        '3 Hemisphere', 'A field cannot tell a place from its mirror image. Choose where the sensor is.',
        button('choose_side', 'Choose in the picture', () => this.setChoosing(!this.choosing)), ' ', make('span', {id: 'setup_sides'}),
        text('setup_hemisphere'));
    step(
        '4 Calibration', 'Move and turn the sensor slowly, away from metal, until both pictures are filled. Without the coupling constant lengths have no scale.',
        make(
            'p', {className: 'fields'}, field('constant', 'coupling constant', '', 'Mean moment of the source coils; gives the scale of all lengths'),
            'm³'),
        make('div', {id: 'coverage', hidden: true}), button('start_motion', 'Start', () => this.toggleMotion('free-motion')),
        text('setup_calibration'));
    step(
        '5 Surroundings', 'Move the sensor through the space that you use: metal there changes the field.',
        button('start_surroundings', 'Start', () => this.toggleMotion('surroundings')), text('setup_surroundings'));
    step(
        '6 Pointer', 'Rest the tip in a small hole and tilt the pointer to all sides for 20 s.',
        button('start_pivot', 'Start', () => this.toggleMotion('pivot')), text('setup_pivot'));
  }

  #put(id, text) {
    if (element(id).textContent !== text) element(id).textContent = text;
  }

  /// Asks the server for the set-up, which one page at a time has.
  async open() {
    this.panel.hidden = false;
    this.shown();
    this.holds = false;
    this.refresh();
    if (!mayControl()) return;
    const answer = await this.#post({});
    this.holds = answer.ok;
    this.refusal = answer.ok ? '' : `${answer.answer}.`;
    this.refresh();
  }

  close() {
    if (this.panel.hidden) return;
    this.panel.hidden = true;
    this.running?.abort();
    this.setChoosing(false);
    if (this.motion) this.#endMotion();
    if (this.holds) this.#post({end: true});
    this.holds = false;
    this.shown();
  }

  get isBusy() { return this.choosing || this.motion !== null || this.running !== null; }

  toggle() { this.panel.hidden ? this.open() : this.close(); }

  /// number: of this page, from the greeting of the server; undefined: a server without a set-up.
  greet(number) {
    this.number = number ?? null;
    this.holds = false;
    this.motion = null;
    if (!this.panel.hidden) this.open();
  }

  async #post(request, signal) {
    try {
      const response = await server.request('setup', {
        method: 'POST',
        headers: {'Content-Type': 'application/json', ...headers()},
        body: JSON.stringify({page: this.number, ...request}),
        signal
      });
      return {ok: response.ok, ...await response.json()};
    } catch (error) {
      return {ok: false, answer: error.name === 'AbortError' ? 'cancelled' : 'server not reachable; nothing was changed'};
    }
  }

  /// Runs a command of the server; its result, or null after a sentence in the field `id`.
  async #run(id, request) {
    if (this.running) {
      this.running.abort();
      return null;
    }
    this.running = new AbortController();
    this.#put(id, 'Working. Close the set-up to cancel.');
    this.refresh();
    const answer = await this.#post(request, this.running.signal);
    this.running = null;
    this.refresh();
    if (answer.ok && answer.result) return answer;
    this.#put(id, answer.ok ? lastLine(answer.message) : answer.answer);
    return null;
  }

  /// Texts of what the device sends now, and which buttons can be used.
  refresh() {
    if (this.panel.hidden) return;
    this.#showNote();
    for (const button of this.steps.querySelectorAll('button')) {
      const isOfMotion = this.motion && button.id === this.motion.button;
      button.disabled = !this.holds || this.running !== null || (this.motion !== null && !isOfMotion);
    }
    this.#put('setup_device', this.#deviceText());
    this.#put('setup_coils', this.#coilText());
    this.#showSides();
    if (this.motion) this.#showMotion();
  }

  #showNote() {
    const needsToken = 'For the set-up, open the link with the token (printed by tricoil serve, or in its --token-file).';
    const text = !mayControl() ? needsToken : this.refusal || 'Results are files in the folder of --record-folder; the hemisphere is used at once.';
    if (this.note.firstChild?.textContent === text) return;
    const again = mayControl() && this.refusal ? [' ', make('button', {onclick: () => this.open()}, 'Try again')] : [];
    this.note.replaceChildren(text, ...again);
  }

  #deviceText() {
    const {health} = page.status;
    const source = element('source').textContent;
    if (page.link === 'down') return 'The server is not reachable.';
    const identity = health?.firmware ? ` Firmware ${health.firmware}, serial ${health.serial}.` : ' It states no firmware.';
    return `${source || 'No device'}: ${page.link === 'live' ? 'connected.' : 'no poses.'}${health ? identity : ''}`;
  }

  #coilText() {
    const sensors = [...page.sensors.values()].filter(({newest}) => newest && !(newest.names.includes('stale') && !newest.names.includes('no_sensor')));
    if (page.link !== 'live' || sensors.length === 0) return 'No coils: poses are missing. Is the device connected, and are its coils on?';
    if (sensors.every(({newest}) => newest.names.includes('no_reference'))) return 'Source coils: no current. Check the power and the cable of the source.';
    const found = sensors.map(
        ({number, newest}) => newest.names.includes('no_sensor') ? `sensor ${number + 1} not found` :
                                                                   `sensor ${number + 1} found, ${newest.snr_db.toFixed(0)} dB`);
    return `Source coils: current found; ${found.join('; ')}.`;
  }

  async findDevices() {
    const answer = await this.#run('setup_found', {run: 'devices'});
    if (!answer) return;
    const list = answer.result.map(({uri, product, fd}) => `${uri} (${product ?? (fd ? 'CAN FD' : 'classic CAN: needs CAN FD')})`);
    this.#put(
        'setup_found',
        list.length ? `${list.join('; ')}. Another device: start tricoil serve again with --device.` : 'No CAN interface and no tricoil USB device.');
  }

  async checkComputer() {
    const answer = await this.#run('setup_found', {run: 'doctor'});
    if (!answer) return;
    // The server itself uses the port of this page.
    const failed = answer.result.checks.filter(({name, ok}) => !ok && name !== `port ${location.port}`);
    this.#put('setup_found', failed.length ? failed.map(({name, found, mend}) => `${name}: ${found}; ${mend}.`).join(' ') : 'All checks passed.');
  }

  setChoosing(on) {
    this.choosing = on;
    element('choose_side').setAttribute('aria-pressed', String(on));
    this.choose(on);
    this.#put('setup_hemisphere', on ? 'Click one of the two places in the picture, or a button.' : '');
  }

  #showSides() {
    const pose = page.newest;
    const sides = this.choosing && Number.isFinite(pose?.position_m[0]) ? sidesOf(pose.position_m) : [];
    const key = sides.map(({name}) => name).join();
    if (key === this.sidesShown) return;
    this.sidesShown = key;
    element('setup_sides')
        .replaceChildren(...sides.flatMap(({name, towards}) => [make('button', {onclick: () => this.chooseSide(towards)}, name), ' ']));
  }

  /// The user has chosen a side, here or in the picture.
  async chooseSide(towards) {
    if (!this.choosing) return;
    this.setChoosing(false);
    const answer = await ask({hemisphere: towards, sensor: page.selected ?? 0});
    this.#put('setup_hemisphere', answer === 'hemisphere set' ? 'Set, and used now.' : answer);
  }

  /// Begins a recording of the set-up. Returns its name, or null after a sentence in the field `id`.
  async #record(kind, id) {
    const refusal = page.playback                     ? 'Leave the playback first.' :
        !page.newest || page.link !== 'live'          ? 'No poses now.' :
        page.sensors.size > 1                         ? 'The set-up is for one sensor: unplug the others, and start tricoil serve again.' :
                                                        '';
    if (refusal) {
      this.#put(id, refusal);
      return null;
    }
    const name = `setup-${kind}-${stamp()}`;
    const answer = await ask({record: true, name}, true);
    if (answer?.startsWith('recording into')) return name;
    this.#put(id, answer === 'already recording' ? 'A recording is running: end it first.' : answer ?? 'Server not reachable.');
    return null;
  }

  async checkWiring() {
    const at = ['x', 'y', 'z'].map(axis => numberIn(element(`at_${axis}`)) / 1000);
    if (!at.every(Number.isFinite)) return this.#put('setup_wiring', 'x, y and z must be numbers.');
    const recording = await this.#record('wiring', 'setup_wiring');
    if (!recording) return;
    this.#put('setup_wiring', 'Recording 2 s.');
    this.motion = {step: 'wiring'};
    await new Promise(done => setTimeout(done, kWiring_ms));
    this.motion = null;
    await ask({record: false}, true);
    const answer = await this.#run('setup_wiring', {run: 'wiring', recording, options: [`--at=${at}`]});
    if (!answer) return;
    const {sensor, source, certain, straight} = answer.result;
    this.#put(
        'setup_wiring',
        !certain     ? 'No wiring fits: is the sensor at this position, its axes parallel to those of the source?' :
            straight ? 'The wiring is straight.' :
                       `Sensor: ${sensor}. Source: ${source}. Exchange or reverse these coils, or start again with --wiring ${answer.file}.`);
  }

  /// Starts or finishes the motion of a step.
  async toggleMotion(step) {
    if (this.motion) return this.#finishMotion();
    const [button, id] = {
      'free-motion': ['start_motion', 'setup_calibration'],
      surroundings: ['start_surroundings', 'setup_surroundings'],
      pivot: ['start_pivot', 'setup_pivot']
    }[step];
    if (step === 'free-motion' && element('constant').value.trim() !== '' && !(numberIn(element('constant')) > 0))
      return this.#put(id, 'The coupling constant must be a number above 0, or empty.');
    const recording = await this.#record(step, id);
    if (!recording) return;
    this.motion = {step, id, button, recording, coverage: new Coverage(this.#pole())};
    element(button).textContent = 'Finish';
    this.refresh();
    element(id).scrollIntoView({block: 'nearest'});
  }

  /// Axis of the half space of the sensor.
  #pole() {
    const towards = page.status.confined_to?.[page.selected] ?? page.newest.position_m;
    return towards.reduce((most, v, n) => Math.abs(v) > Math.abs(towards[most]) ? n : most, 0);
  }

  #hemisphere() {
    const towards = page.status.confined_to?.[page.selected];
    if (towards) return towards;
    const p = page.newest.position_m, pole = this.#pole();
    return [0, 1, 2].map(n => n === pole ? Math.sign(p[n]) || 1 : 0);
  }

  /// Call it for every valid pose of the chosen sensor.
  collect(pose) { this.motion?.coverage?.add(pose); }

  #showMotion() {
    const {step, id, coverage} = this.motion;
    if (!coverage) return;
    // The status comes after the answer to the request.
    this.motion.begun ||= page.status.recording;
    if (this.motion.begun && !page.status.recording) {
      this.#endMotion();
      return this.#put(id, page.status.recording_error || 'The recording was ended by another page.');
    }
    if (step === 'pivot') return this.#put(id, `${coverage.poses} poses.`);
    if (step === 'surroundings') return this.#put(id, `${coverage.poses} poses. ${metalText(coverage)}`);
    const shown = element('coverage');
    shown.hidden = false;
    shown.innerHTML = `<figure>${coverage.ofSource.picture}<span>around the source</span></figure><figure>${
        coverage.ofSensor.picture}<span>turned</span></figure>`;
    this.#put(id, coverage.text.join(' '));
    element('start_motion').classList.toggle('primary', coverage.isGood);
  }

  #endMotion() {
    element(this.motion.button ?? 'start_motion').textContent = 'Start';
    element('start_motion').classList.remove('primary');
    this.motion = null;
    return ask({record: false}, true);
  }

  async #finishMotion() {
    const {step, id, recording, coverage} = this.motion;
    const hemisphere = this.#hemisphere();
    await this.#endMotion();
    if (coverage.poses === 0) return this.#put(id, 'No valid pose was recorded.');
    if (step === 'surroundings')
      return this.#put(
          id, `${metalText(coverage)} ${
                  coverage.flagged || coverage.worst?.mm > 2 ? 'Remove the metal, or calibrate it: tricoil calibrate surroundings.' :
                                                               'No metal that disturbs.'}`);
    const constant = numberIn(element('constant'));
    const options = step === 'pivot' ? [] : [`--hemisphere=${hemisphere}`];
    if (step !== 'pivot' && Number.isFinite(constant)) options.push(`--coupling-constant=${constant}`);
    const answer = await this.#run(id, {run: step, recording, options});
    if (answer) this.#put(id, step === 'pivot' ? pivotText(answer) : calibrationText(answer, Number.isFinite(constant)));
    if (step === 'free-motion' && !coverage.isGood) this.#put(id, `${element(id).textContent} ${coverage.text.slice(0, 2).join(' ')}`);
  }
}

function metalText({worst, distortion_mm, flagged, poses}) {
  if (!worst) return '';
  const [x, y, z] = worst.position_m.map(v => Math.round(1000 * v));
  return `Distortion ${distortion_mm.toFixed(2)} mm RMS, most ${worst.mm.toFixed(1)} mm at ${x}, ${y}, ${z} mm; ${
      percent(flagged / poses)} of the poses are flagged.`;
}

function pivotText({result, file}) {
  const tip = result.tip_m.map(v => (1000 * v).toFixed(2)).join(', '), sigma = Math.hypot(...result.tip_std_m);
  return `Tip at ${tip} mm, ± ${(1000 * sigma).toFixed(3)} mm, residual ${(1000 * result.residual_rms_m).toFixed(2)} mm RMS. ${
      result.warnings.join(' ')} Start again with --tip ${file}.`;
}

function calibrationText({result, file}, hasScale) {
  return `${result.frames} column frames, unexplained ${percent(result.misfit_before)} before and ${percent(result.misfit_after)} after. ${
      result.warnings.map(text => `${text}.`).join(' ')} ${
      hasScale ? `Start again with --calibration ${file}.` : `Written: ${file}, without a scale of lengths.`}`;
}
