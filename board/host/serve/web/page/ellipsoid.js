// Ellipsoid of a sensor's position covariance: an outline, so that it hides neither the sensor nor its true pose.
import {Color, Mesh, ShaderMaterial, SphereGeometry} from 'three';

export const kSigmas = 3;
const kMost_m = 1;  // limit of each entry of the transform

const kVertex = `
  varying vec3 facing, view;
  void main() {
    vec4 place = modelViewMatrix * vec4(position, 1.0);
    facing = normalMatrix * normal;
    view = -place.xyz;
    gl_Position = projectionMatrix * place;
  }`;
// Nearly transparent where the surface faces the viewer, opaque at its outline.
const kFragment = `
  uniform vec3 color;
  varying vec3 facing, view;
  void main() {
    float edge = 1.0 - abs(dot(normalize(facing), normalize(view)));
    gl_FragColor = vec4(color, mix(0.1, 0.75, edge * edge * edge));
    #include <colorspace_fragment>
  }`;

/// Unit sphere without depth test, so that the sensor inside does not hide it. drawnFactor() gives its transform.
export function ellipsoidMesh() {
  const material = new ShaderMaterial({
    uniforms: {color: {value: new Color()}},
    vertexShader: kVertex,
    fragmentShader: kFragment,
    transparent: true,
    depthTest: false,
    depthWrite: false
  });
  const mesh = new Mesh(new SphereGeometry(1, 32, 16), material);
  mesh.matrixAutoUpdate = false;
  mesh.frustumCulled = false;
  return mesh;
}

/// Cholesky factor L, row by row, of the covariance [xx, xy, xz, yy, yz, zz]. L maps the unit sphere to the 1 sigma ellipsoid.
export function cholesky([xx, xy, xz, yy, yz, zz]) {
  const a = Math.sqrt(Math.max(xx, 1e-14));
  const b = xy / a, c = xz / a;
  const d = Math.sqrt(Math.max(yy - b * b, 1e-14));
  const e = (yz - b * c) / d;
  return [a, b, d, c, e, Math.sqrt(Math.max(zz - c * c - e * e, 1e-14))];
}

/// Transform from the unit sphere to the ellipsoid, drawn `scale` times too large.
export function drawnFactor(covariance, scale) { return cholesky(covariance).map(v => Math.max(-kMost_m, Math.min(kSigmas * scale * v, kMost_m))); }
