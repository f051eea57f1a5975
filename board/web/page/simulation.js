// The simulation of the demo (demo.cpp), compiled to WebAssembly.
import makeModule from 'tricoil-demo';

/// Downloads and compiles the program. Throws if that fails.
export async function load(url) {
  const response = await fetch(url);
  if (!response.ok) throw new Error(`${url}: ${response.status} ${response.statusText}`);
  return WebAssembly.compile(await response.arrayBuffer());
}

/// An instance of the program; program: WebAssembly.Module.
export function instanceOf(program) {
  const instantiateWasm = (imports, done) => {
    WebAssembly.instantiate(program, imports).then(instance => done(instance));
    return {};
  };
  return makeModule({instantiateWasm, locateFile: name => name});
}

/// One run of the simulation.
export class Simulation {
  #begin;
  #advance;

  static async start(program) { return new Simulation(await instanceOf(program)); }

  constructor(module) {
    this.#begin = module.cwrap('tricoil_demo_begin', 'string', ['number', 'boolean', 'number', 'boolean']);
    this.#advance = module.cwrap('tricoil_demo_advance', 'string', ['number']);
  }

  /// Begins a step of the tour, from 0. Throws with the program's reason.
  begin({step, compensated, speed, noise}) {
    const refusal = this.#begin(step, compensated, speed, noise);
    if (refusal) throw new Error(refusal);
  }

  /// Simulates `seconds`. Returns the message with their poses, as a server would send it. Throws with the program's reason.
  advance(seconds) {
    const text = this.#advance(seconds);
    if (!text.startsWith('data: ')) throw new Error(text);
    return JSON.parse(text.slice('data: '.length));
  }
}
