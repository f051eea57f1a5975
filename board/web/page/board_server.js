// Stands in for the server of the live page: a board on a serial port of this computer (Web Serial), read by the program (board.cpp).
const kPeriodMs = 33, kBaud = 115200;  // a USB port has no baud rate

/// The user chooses the port. Throws if there is none, or it cannot be opened.
export async function openBoard(module) {
  const port = await navigator.serial.requestPort();
  await port.open({baudRate: kBaud, bufferSize: 65536});
  return new BoardServer(module, port);
}

class BoardServer {
  #chunks = [];
  #running = true;
  #advance;
  #unsent;
  #setHemisphere;

  constructor(module, port) {
    this.port = port;
    this.writer = port.writable.getWriter();
    this.lost = null;  // why the port ended
    const event = text => {
      if (!text.startsWith('data: ')) throw new Error(text);
      return JSON.parse(text.slice('data: '.length));
    };
    const advance = module.cwrap('tricoil_board_advance', 'string', ['array', 'number', 'boolean']);
    this.#advance = (bytes, running) => event(advance(bytes, bytes.length, running));
    this.#unsent = module.cwrap('tricoil_board_unsent', 'string', []);
    this.#setHemisphere = module.cwrap('tricoil_board_set_hemisphere', null, ['number', 'number', 'number', 'number']);
    module._tricoil_board_begin();
    this.#read();
  }

  async #read() {
    const reader = this.port.readable.getReader();
    try {
      for (;;) {
        const {value, done} = await reader.read();
        if (done) throw new Error('the port was closed');
        this.#chunks.push(value);
      }
    } catch ({message}) {
      this.lost = message;
    }
  }

  /// Calls take(message) for every event until the port is lost; then ended(why).
  start(take, ended) {
    let isFirst = true;
    const timer = setInterval(() => {
      try {
        const bytes = new Uint8Array(this.#chunks.reduce((sum, chunk) => sum + chunk.length, 0));
        this.#chunks.reduce((at, chunk) => (bytes.set(chunk, at), at + chunk.length), 0);
        this.#chunks = [];
        const message = this.#advance(bytes, this.#running);
        if (!isFirst) delete message.hello;  // the page learns it once
        isFirst = false;
        this.#send();
        take(message);
        if (this.lost) throw new Error(this.lost);
      } catch ({message}) {
        clearInterval(timer);
        ended(message);
      }
    }, kPeriodMs);
  }

  #send() {
    const digits = this.#unsent();
    if (digits) this.writer.write(Uint8Array.from(digits.match(/../g), pair => parseInt(pair, 16))).catch(({message}) => this.lost = message);
  }

  /// A request of the page's controls. Returns the answer.
  control({run, hemisphere, sensor = 0}) {
    if (hemisphere) {
      this.#setHemisphere(sensor, ...hemisphere);
      return 'hemisphere set';
    }
    if (typeof run !== 'boolean') throw new Error('needs tricoil serve');
    this.#running = run;
    return run ? 'running' : 'stopped, coils off';
  }
}
