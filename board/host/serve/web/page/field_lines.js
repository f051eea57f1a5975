// Field lines of a dipole at the origin: r = R sin^2(angle to the moment).
import {BufferGeometry, Float32BufferAttribute, LineBasicMaterial, LineSegments, Quaternion, Vector3} from 'three';

const kReach_m = [0.25, 0.5, 0.9, 1.4];  // R, where a line crosses the plane of the coil
const kMeridians = 12;
const kSteps = 48;
const kInside_m = 0.06;  // not drawn within the source

/// faint: lines of several coils are drawn together.
export function fieldLines(axis, color, faint) {
  const meridians = faint ? kMeridians / 2 : kMeridians, reaches = faint ? kReach_m.slice(0, 3) : kReach_m;
  const points = [];
  for (const reach of reaches) {
    for (let meridian = 0; meridian < meridians; ++meridian) {
      const about = 2 * Math.PI * meridian / meridians;
      const at = step => {
        const angle = Math.PI * step / kSteps;
        const r = reach * Math.sin(angle) ** 2;
        return [r * Math.sin(angle) * Math.cos(about), r * Math.sin(angle) * Math.sin(about), r * Math.cos(angle)];
      };
      for (let step = 0; step < kSteps; ++step) {
        const ends = [at(step), at(step + 1)];
        if (ends.every(p => Math.hypot(...p) > kInside_m)) points.push(...ends.flat());
      }
    }
  }
  const lines = new LineSegments(
      new BufferGeometry().setAttribute('position', new Float32BufferAttribute(points, 3)),
      new LineBasicMaterial({color, transparent: true, opacity: faint ? 0.13 : 0.32, depthWrite: false}));
  lines.quaternion.copy(
      new Quaternion().setFromUnitVectors(new Vector3(0, 0, 1), new Vector3(...['x', 'y', 'z'].map(name => name === axis ? 1 : 0))));
  return lines;
}
