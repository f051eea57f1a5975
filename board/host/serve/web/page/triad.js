// Solids of the scene: a body with three coils and labelled axes, and labels that face the viewer.
import {BoxGeometry, CanvasTexture, ConeGeometry, CylinderGeometry, Group, Mesh, MeshLambertMaterial, Quaternion, Sprite, SpriteMaterial, SRGBColorSpace, TorusGeometry, Vector3} from 'three';

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

/// Labels that are too small to read are drawn larger. pixels: height of the picture.
export function keepLegible(object, camera, pixels) {
  object.traverse(part => {
    if (!part.isSprite) return;
    const {height} = part.userData;
    const shown = height * pixels / (2 * Math.tan(camera.fov * Math.PI / 360) * part.getWorldPosition(place).distanceTo(camera.position));
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

function arrow(direction, length, radius, color) {
  const material = new MeshLambertMaterial({color});
  const head = 4 * radius;
  const shaft = new Mesh(new CylinderGeometry(radius, radius, length - 2 * head, 12), material);
  const tip = new Mesh(new ConeGeometry(2.4 * radius, 2 * head, 16), material);
  shaft.position.y = (length - 2 * head) / 2;
  tip.position.y = length - head;
  const group = new Group();
  group.add(shaft, tip);
  group.quaternion.copy(new Quaternion().setFromUnitVectors(kUp, direction));
  return group;
}

/// body: edge of the cube that carries the coils (m). length: of the axes. text: height of their names; 0: none.
export function triad(body, length, text) {
  const group = new Group();
  group.add(new Mesh(new BoxGeometry(0.86 * body, 0.86 * body, 0.86 * body), new MeshLambertMaterial({color: palette.core})));
  for (const [name, direction] of Object.entries(kDirections)) {
    const color = palette[name];
    const coil = new Mesh(new TorusGeometry(0.66 * body, 0.085 * body, 10, 40), new MeshLambertMaterial({color}));
    coil.quaternion.setFromUnitVectors(kTorusAxis, direction);
    group.add(coil, arrow(direction, length, 0.055 * body + 0.0012, color));
    if (text > 0) {
      const sprite = label(name, text, color);
      sprite.position.copy(direction).multiplyScalar(length + 0.6 * text);
      group.add(sprite);
    }
  }
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
