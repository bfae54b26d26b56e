// Light from all around, as in a photographer's studio: a soft box above, one at each side.
//
// Made of a few pixels here: a rendered room takes phones and software renderers seconds.

import * as THREE from "three";

const WIDTH = 128;
const HEIGHT = 64;

/** Brightness by direction: [longitude and latitude of the middle, their widths, strength]. */
const BOXES = [
  [0.0, 1.45, 9.0, 0.55, 2.5],
  [0.9, 0.5, 0.5, 0.5, 3.0],
  [-2.2, 0.35, 0.45, 0.6, 2.2],
  [2.6, 0.3, 0.7, 0.3, 1.1],
];

export function studio(renderer) {
  const data = new Float32Array(4 * WIDTH * HEIGHT);
  for (let y = 0; y < HEIGHT; y += 1) {
    const latitude = ((y + 0.5) / HEIGHT - 0.5) * Math.PI;
    for (let x = 0; x < WIDTH; x += 1) {
      const longitude = ((x + 0.5) / WIDTH - 0.5) * 2 * Math.PI;
      // A floor in half light, walls that brighten upwards.
      let light = 0.34 + 0.42 * (Math.sin(latitude) * 0.5 + 0.5);
      for (const [lon, lat, wide, high, strength] of BOXES) {
        const across = Math.abs(Math.atan2(Math.sin(longitude - lon), Math.cos(longitude - lon))) / wide;
        const up = Math.abs(latitude - lat) / high;
        light += strength * soft(across) * soft(up);
      }
      // A little cool from below, a little warm from above.
      const warm = 0.03 * Math.sin(latitude);
      data.set([light * (1 + warm), light, light * (1 - warm), 1], 4 * (y * WIDTH + x));
    }
  }
  const picture = new THREE.DataTexture(data, WIDTH, HEIGHT, THREE.RGBAFormat, THREE.FloatType);
  picture.mapping = THREE.EquirectangularReflectionMapping;
  picture.minFilter = picture.magFilter = THREE.LinearFilter;
  picture.needsUpdate = true;
  const generator = new THREE.PMREMGenerator(renderer);
  const { texture } = generator.fromEquirectangular(picture);
  generator.dispose();
  picture.dispose();
  return texture;
}

/** 1 within, 0 beyond the edge, smooth between. */
function soft(distance) {
  const t = Math.min(1, Math.max(0, (1.25 - distance) / 0.5));
  return t * t * (3 - 2 * t);
}
