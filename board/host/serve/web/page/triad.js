// Solids of the scene: a body with three coils and labelled axes, and labels that face the viewer.
import {BoxGeometry, BufferAttribute, CanvasTexture, Color, ConeGeometry, CylinderGeometry, Group, Mesh, MeshLambertMaterial, Quaternion, Sprite, SpriteMaterial, SRGBColorSpace, TorusGeometry, Vector3} from 'three';
import {mergeGeometries} from 'three/addons/utils/BufferGeometryUtils.js';

import {palette} from './palette.js';

const kDirections = {
  x: new Vector3(1, 0, 0),
  y: new Vector3(0, 1, 0),
  z: new Vector3(0, 0, 1)
};
const kUp = new Vector3(0, 1, 0);  // axis of cylinders and cones
const kTorusAxis = new Vector3(0, 0, 1);
const kPixels = 96;

const kLeast_px = 18;  // height of a label: letters of 12 pixels
const place = new Vector3();

/// Labels that are too small to read are drawn larger. pixel: size of a pixel at a distance of 1 m.
export function keepLegible(object, camera, pixel) {
  object.traverse(part => {
    if (!part.isSprite) return;
    const {height} = part.userData;
    const shown = height / (pixel * part.getWorldPosition(place).distanceTo(camera.position));
    const drawn = height * Math.max(1, kLeast_px / Math.max(shown, 1e-3));
    part.scale.set(part.scale.x / part.scale.y * drawn, drawn, 1);
  });
}

/// Text that faces the viewer; height in m.
export function label(text, height, color) {
  const canvas = document.createElement('canvas');
  const context = canvas.getContext('2d');
  const font = `600 ${kPixels * 0.7}px system-ui, sans-serif`;
  context.font = font;
  canvas.width = Math.ceil(context.measureText(text).width) + kPixels / 2;
  canvas.height = kPixels;
  context.font = font;
  context.fillStyle = color;
  context.textAlign = 'center';
  context.textBaseline = 'middle';
  context.fillText(text, canvas.width / 2, kPixels / 2);
  const texture = new CanvasTexture(canvas);
  texture.colorSpace = SRGBColorSpace;
  const sprite = new Sprite(new SpriteMaterial({map: texture, depthTest: false, transparent: true}));
  sprite.scale.set(height * canvas.width / kPixels, height, 1);
  sprite.renderOrder = 2;
  sprite.userData.height = height;
  return sprite;
}

/// Parts of an arrow along y.
function arrow(length, radius) {
  const head = 4 * radius;
  const shaft = new CylinderGeometry(radius, radius, length - 2 * head, 8, 1, true).translate(0, (length - 2 * head) / 2, 0);
  return [shaft, new ConeGeometry(2.4 * radius, 2 * head, 12).translate(0, length - head, 0)];
}

function colored(geometry, color) {
  const {r, g, b} = new Color(color);
  return geometry.setAttribute('color', new BufferAttribute(new Float32Array(geometry.attributes.position.count * 3).map((_, k) => [r, g, b][k % 3]), 3));
}

/// body: edge of the cube that carries the coils (m). length: of the axes. text: height of their names; 0: none. The solids are one
/// mesh: without a graphics processor, each mesh takes long.
export function triad(body, length, text) {
  const parts = [colored(new BoxGeometry(0.86 * body, 0.86 * body, 0.86 * body), palette.core)];
  const group = new Group();
  for (const [name, direction] of Object.entries(kDirections)) {
    const coil = new TorusGeometry(0.66 * body, 0.085 * body, 6, 24).applyQuaternion(new Quaternion().setFromUnitVectors(kTorusAxis, direction));
    const along = new Quaternion().setFromUnitVectors(kUp, direction);
    const axis = arrow(length, 0.055 * body + 0.0012).map(part => part.applyQuaternion(along));
    parts.push(...[coil, ...axis].map(part => colored(part, palette[name])));
    if (text > 0) {
      const sprite = label(name, text, palette[name]);
      sprite.position.copy(direction).multiplyScalar(length + 0.6 * text);
      group.add(sprite);
    }
  }
  group.add(new Mesh(mergeGeometries(parts), new MeshLambertMaterial({vertexColors: true})));
  return group;
}

/// Frees the memory of an object and of its children on the graphics processor.
export function dispose(object) {
  object.traverse(part => {
    part.geometry?.dispose();
    part.material?.map?.dispose();
    part.material?.dispose();
  });
}
