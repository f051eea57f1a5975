// Line with the quality of the measurement: a light, a sentence, the remedy, and a question if its answer is the remedy.
import {sidesOf} from './quality.js';

const kSigns = {
  good: '●',
  caution: '▲',
  bad: '✕',
  off: '○'
};
const kWords = {
  good: 'good',
  caution: 'caution',
  bad: 'not usable',
  off: 'no measurement'
};
const kCalmMs = 300;    // between changes of the numbers in the sentence
const kSteadyMs = 700;  // a cause that lasts is announced to a screen reader

const element = id => document.getElementById(id);

export class Guide {
  #cause = null;
  #sinceMs = 0;  // of the present cause
  #shownMs = 0;
  #announced = null;
  #asked = '';

  /// answer(towards): the user has chosen a side of the source.
  constructor(answer) { this.answer = answer; }

  show(quality, pose, mayControl) {
    const ms = performance.now();
    const changed = quality.cause !== this.#cause;
    if (changed) this.#sinceMs = ms;
    this.#cause = quality.cause;
    if (!changed && ms - this.#shownMs < kCalmMs) return;
    this.#shownMs = ms;
    document.body.dataset.quality = quality.level;
    element('light').textContent = kSigns[quality.level];
    element('word').textContent = kWords[quality.level];
    element('reason').textContent = quality.text;
    element('remedy').textContent = quality.remedy;
    if (ms - this.#sinceMs >= kSteadyMs) this.#announce(quality, pose);
    const sides = quality.cause === 'hemisphere_unknown' && Number.isFinite(pose?.position_m[0]) ? sidesOf(pose.position_m) : [];
    const asked = sides.map(side => side.name).join() + mayControl;
    if (asked !== this.#asked) this.#ask(sides, mayControl);
    this.#asked = asked;
  }

  /// Text for a screen reader; changes rarely, because a screen reader speaks every change.
  #announce(quality, pose) {
    if (quality.cause === this.#announced) return;
    this.#announced = quality.cause;
    element('announcement').textContent =
        `Sensor ${(pose?.sensor ?? 0) + 1}: ${kWords[quality.level]}. ${quality.cause === 'tracking' ? '' : `${quality.text} ${quality.remedy}`}`;
  }

  #ask(sides, mayControl) {
    element('sides').replaceChildren(...sides.map(({name, towards}) => {
      const button = document.createElement('button');
      button.textContent = name;
      button.dataset.side = towards.join(',');
      button.disabled = !mayControl;
      button.title = mayControl ? `The sensor is on the ${name} side of the source` : 'Needs the link for controls';
      button.addEventListener('click', () => this.answer(towards));
      return button;
    }));
  }
}
