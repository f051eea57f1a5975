// Poses of the demo in a browser against those of the native program: equal without noise, with the same error with noise.
//   node compare_poses.cjs FOLDER_OF_NODE_MODULES FOLDER_OF_DEMO TRICOIL
const {execFileSync} = require('child_process');
const fs = require('fs');
const path = require('path');
const [, site, program] = process.argv.slice(2);
const makeModule = require(path.resolve(site, '..', 'tricoil-demo.js'));

const kSameAs = 1e-12, kSameRms = 0.05;
const kDuration_s = 3, kNoisy_s = 20, kSettling_s = 0.5;

function check(condition, what) {
  if (!condition) throw new Error(what);
  console.log(`compare_poses: ${what}`);
}

/// {hello, status, poses: [{time_us, flags, numbers: position and quaternion, true_m}]} of a step in the demo.
function inDemo(module, {step, compensated, speed, noise}, seconds) {
  const begin = module.cwrap('tricoil_demo_begin', 'string', ['number', 'boolean', 'number', 'boolean']);
  const advance = module.cwrap('tricoil_demo_advance', 'string', ['number']);
  if (begin(step, compensated, speed, noise) !== '') throw new Error('the step does not begin');
  let first = null;
  const poses = [];
  for (let n = 0; n < 10 * seconds; ++n) {
    const message = JSON.parse(advance(0.1).slice('data: '.length));
    first ??= message;
    poses.push(...message.poses);
  }
  return {
    ...first,
    poses: poses.map(values => ({time_us: values[1], flags: values[3], numbers: values.slice(5, 12), true_m: values.at(-1).slice(0, 3)}))
  };
}

const nativeOptions = (tour, {step, compensated, speed, noise}, seconds) => [
  'run', '--scenario', tour[step].scenario, ...tour[step].faults.flatMap(fault => ['--fault', fault]), '--mux', 'tdm', '--confined', '--tracker',
  ...(compensated ? ['scaat'] : ['direct', '--no-deskew']), '--speed', String(speed), ...(noise ? [] : ['--no-noise']), '--duration',
  String(seconds)
];
const run = options => execFileSync(program, options, {encoding: 'utf8', stdio: ['ignore', 'pipe', 'ignore'], maxBuffer: 1 << 28});

function compareExactly(module, tour, place) {
  const demo = inDemo(module, place, kDuration_s).poses;
  const native = run([...nativeOptions(tour, place, kDuration_s), '--json-lines', '-']).trim().split('\n').map(line => JSON.parse(line));
  const name = `step ${place.step + 1}, ${place.compensated ? 'with' : 'without'} compensation, speed ${place.speed}`;
  check(native.length > 100 && Math.abs(demo.length - native.length) <= 1, `${name}: ${demo.length} poses, native ${native.length}`);
  let worst = 0, differing = 0;
  for (let n = 0; n < Math.min(demo.length, native.length); ++n) {
    // Without a sensor there are no numbers: null.
    const numbers = [...native[n].position_m ?? [0, 0, 0], ...native[n].q_wxyz ?? [0, 0, 0, 0]];
    if (demo[n].time_us !== native[n].time_us || demo[n].flags !== native[n].flags) ++differing;
    numbers.forEach((value, k) => {
      worst = Math.max(worst, Math.abs(value - demo[n].numbers[k]));
    });
  }
  check(differing === 0 && worst <= kSameAs, `${name}: largest difference ${worst}, other times or flags ${differing}`);
}

function compareError(module, {source: {tour}, invalidating}, place) {
  const demo = inDemo(module, place, kNoisy_s).poses;
  const scored = demo.filter(pose => pose.time_us >= 1e6 * kSettling_s && (pose.flags & invalidating) === 0);
  const rms_m = Math.sqrt(scored.reduce((sum, {numbers, true_m}) => sum + true_m.reduce((s, v, k) => s + (v - numbers[k]) ** 2, 0), 0) / scored.length);
  const native_m = JSON.parse(run([...nativeOptions(tour, place, kNoisy_s), '--json'])).position_rms_m;
  check(
      Math.abs(rms_m / native_m - 1) <= kSameRms,
      `step ${place.step + 1} with noise: error ${(1000 * rms_m).toFixed(4)} mm RMS, native ${(1000 * native_m).toFixed(4)} mm`);
}

async function main() {
  const program = await WebAssembly.compile(fs.readFileSync(path.join(site, 'demo.wasm')));
  const instantiateWasm = (imports, done) => {
    WebAssembly.instantiate(program, imports).then(instance => done(instance));
    return {};
  };
  const module = await makeModule({instantiateWasm, locateFile: name => name});
  const begin = module.cwrap('tricoil_demo_begin', 'string', ['number', 'boolean', 'number', 'boolean']);
  const {hello, status} = inDemo(module, {step: 0, compensated: true, speed: 1, noise: true}, 0.1);
  const {tour} = hello.source;
  check(tour.length === 5 && status.running && status.tour.step === 0, 'the demo has five steps');
  for (const [step, speed] of [[5, 1], [-1, 1], [0, 0], [0, NaN], [0, 1e9]])
    check(/no step/.test(begin(step, true, speed, true)), `step ${step} at speed ${speed} is refused`);
  for (let step = 0; step < tour.length; ++step) compareExactly(module, tour, {step, compensated: tour[step].compensated, speed: 1, noise: false});
  for (const compensated of [false, true]) compareExactly(module, tour, {step: 2, compensated, speed: 2.5, noise: false});
  for (const step of [1, 2, 3]) compareError(module, hello, {step, compensated: tour[step].compensated, speed: 1, noise: true});
}

main().catch(error => {
  console.error(`compare_poses: FAILED: ${String(error.stack).slice(0, 2000)}`);
  process.exit(1);
});
