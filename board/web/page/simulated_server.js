// Stands in for the server of the live page: streams the events of a simulation, and answers the requests.
import {say} from '../../host/serve/web/page/controls.js';
import {learn} from '../../host/serve/web/page/sample.js';
import {server} from '../../host/serve/web/page/server.js';
import {openBoard} from './board_server.js';
import {instanceOf, load, Simulation} from './simulation.js';

const kPeriodMs = 33, kLongest_s = 0.25;  // of an event; longer pauses, as of a hidden page, are left out

const answer = (content, status = 200) => new Response(JSON.stringify(content), {status});

/// The link's choice: #step=2&speed=1.5&noise=no.
function linkedPlace() {
  const given = new URLSearchParams(location.hash.slice(1));
  const within = (name, low, high) => given.has(name) && given.get(name) >= low && given.get(name) <= high ? Number(given.get(name)) : 1;
  return {step: Math.floor(within('step', 1, 5)) - 1, speed: within('speed', 0.25, 3), noise: given.get('noise') !== 'no'};
}

class SimulatedServer {
  #simulation = null;
  #running = true;
  #steps = [];  // of the tour
  #place = null;  // {step, compensated, speed, noise}
  #hello = null;  // for the first message
  #board = null;  // BoardServer instead of the simulation

  /// What takes the place of the methods of `server`.
  get methods() { return {events: () => this.#open(), request: (path, options) => this.#request(path, options)};}

  /// As an EventSource.
  #open() {
    const source = {close: () => clearInterval(source.timer)};
    this.#start(source).catch(({message}) => {
      document.getElementById('problem').textContent = `The simulation cannot be loaded: ${message}`;
      source.onerror();
    });
    return source;
  }

  async #start(source) {
    const program = await load(new URL('demo.wasm', document.baseURI));
    this.#simulation = await Simulation.start(program);
    this.#begin({...linkedPlace(), compensated: true});
    this.#hello = this.#simulation.advance(0).hello;
    learn(this.#hello);
    this.#steps = this.#hello.source.tour;
    this.#begin(this.#linked(this.#place));
    source.onopen();
    this.#offerBoard(program, source);
    let before = performance.now();
    source.timer = setInterval(() => {
      const now = performance.now();
      try {
        source.onmessage({data: JSON.stringify(this.#message(Math.min((now - before) / 1000, kLongest_s)))});
      } catch (error) {
        clearInterval(source.timer);
        document.getElementById('problem').textContent = `The simulation ended: ${error.message}`;
        throw error;
      }
      before = now;
    }, kPeriodMs);
    addEventListener('hashchange', () => this.#begin(this.#linked(linkedPlace())));
  }

  /// A button reads a board on a serial port instead of the simulation.
  #offerBoard(program, source) {
    if (!navigator.serial || document.getElementById('read_board')) return;
    const button = Object.assign(document.createElement('button'), {
      id: 'read_board',
      textContent: 'Read a board',
      title: 'Board on a serial port of this computer, by Web Serial. Tested with recorded bytes, not yet with hardware.'
    });
    document.getElementById('help').before(button);
    button.addEventListener('click', async () => {
      try {
        this.#board = await openBoard(await instanceOf(program));
        clearInterval(source.timer);
        document.getElementById('problem').textContent = '';
        button.disabled = true;
        this.#board.start(message => source.onmessage({data: JSON.stringify(message)}), why => {
          document.getElementById('problem').textContent = `The board was lost: ${why}. Load this page again.`;
        });
        say('Reading a board. This is not yet tested with hardware.');
      } catch ({message}) {
        say(`No board: ${message}`);
      }
    });
  }

  /// The place of a link, with the compensation of its step.
  #linked(place) { return {...place, compensated: this.#steps[place.step].compensated}; }

  #begin(place) {
    this.#simulation.begin(place);
    this.#place = place;
  }

  #message(elapsed_s) {
    const message = this.#simulation.advance(this.#running ? elapsed_s : 0);
    message.status.running = this.#running;
    if (this.#hello) message.hello = this.#hello;
    this.#hello = null;
    return message;
  }

  async #request(path, {body} = {}) {
    if (path === 'setup') return answer({answer: 'not in this demo'}, 400);
    if (path === 'recordings') return answer({recordings: []});
    try {
      return answer({answer: this.#control(JSON.parse(body))});
    } catch ({message}) {
      return answer({answer: message}, 400);
    }
  }

  #control(request) {
    if (this.#board) return this.#board.control(request);
    const {step, compensated, speed, run} = request;
    if (step !== undefined) {
      this.#begin({...this.#place, step, compensated, speed: speed ?? this.#place.speed});
      return 'the tour goes on';
    }
    if (run === undefined) throw new Error('not in this demo');
    this.#running = run;
    return run ? 'running' : 'stopped, coils off';
  }
}

Object.assign(server, new SimulatedServer().methods);
