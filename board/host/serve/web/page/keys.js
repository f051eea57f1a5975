// Keys of the page, and the text of its help.
import {errorGradient} from './palette.js';
import {make} from './tools.js';

/// [key, name in the help, meaning]. main.js has the actions, by key.
const kKeys = [
  [' ', 'space', 'start or stop the coils (asks first); in playback: play or pause'],
  ['h', 'h', 'set the hemisphere'],
  ['b', 'b', 'boresight: the present attitude reads zero, on this page only'],
  ['u', 'u', 'clear the boresight'],
  ['r', 'r', 'start or end a recording'],
  ['p', 'p', 'click the button of the stylus'],
  ['c', 'c', 'capture a point'],
  ['v', 'v', 'capture the average of the last second'],
  ['t', 't', 'tools: points, pivot, recordings, levels'],
  ['l', 'l', 'levels: coupling, level, noise and signal to noise of each channel'],
  ['s', 's', 'set-up of a device'],
  ['k', 'k', 'pause the plots, or follow again'],
  ['+', '+', 'zoom the plots in'],
  ['-', '-', 'zoom the plots out'],
  ['Arrows', '← →', 'on a plot: cursor; on the scene: turn'],
  ['e', 'e', 'save the time shown as CSV'],
  ['0', '0', 'view: source and sensors'],
  ['1', '1', 'view from above'],
  ['2', '2', 'view from −x'],
  ['3', '3', 'view from −y'],
  ['f', 'f', 'follow the sensors with the camera'],
  ['g', 'g', 'field lines: x, y, z, all, off'],
  ['n', 'n', 'next sensor'],
  ['m', 'm', 'theme: system, light, dark'],
  ['.', '.', 'demo: next step'],
  [',', ',', 'demo: step before'],
  ['x', 'x', 'demo: with or without motion compensation'],
  ['[', '[ ]', 'demo: slower or faster motion'],
  ['?', '?', 'this help'],
  ['Escape', 'esc', 'leave playback']
];
const kColors = [
  ['●', 'good', 'the pose may be used'], ['▲', 'caution', 'usable, with a warning: metal, missing measurements, or distortion above your limit'],
  ['✕', 'not usable', 'the sentence states the cause and the remedy'],
  ['○', 'no measurement', 'coils off, no poses, or no server: all values are old']
];

export function fillHelp(parent) {
  const scale = make('span', {className: 'bar'});
  scale.style.cssText = `display:inline-block;width:6rem;height:.5rem;border-radius:.25rem;background:${errorGradient()}`;
  parent.append(
      make('table', {}, ...kKeys.map(([, name, meaning]) => make('tr', {}, make('td', {}, make('kbd', {}, name)), make('td', {}, meaning)))),
      make('h2', {}, 'Light'),
      make('table', {}, ...kColors.map(([sign, word, meaning]) => make('tr', {}, make('td', {}, `${sign} ${word}`), make('td', {}, meaning)))),
      make(
          'p', {}, 'Axes: x red, y green, z blue, in scene and plots. Trail and ellipsoid: expected error, 0.1 mm ', scale,
          ' 10 mm. The ellipsoid: 3 times the expected error of this pose, drawn larger by the factor below it. RMS 1 s: over the last second. Drag over a plot to zoom; double-click to follow again.'));
}

/// actions: by key.
export function listen(actions) {
  document.addEventListener('keydown', event => {
    const {tagName, type} = event.target;
    const typing = tagName === 'SELECT' || (tagName === 'INPUT' && type !== 'range') || (event.target.tagName === 'BUTTON' && event.key === ' ');
    if (typing || event.repeat || event.ctrlKey || event.metaKey || event.altKey || document.querySelector('dialog[open]') || !actions[event.key])
      return;
    event.preventDefault();
    actions[event.key]();
  });
}
