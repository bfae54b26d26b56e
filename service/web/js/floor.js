// The floor: a grid that fades out, with lines every 1, 10, 100 ... of a unit, and a soft shadow.

import * as THREE from "three";

const VERTEX = `
varying vec2 place;
void main() {
  vec4 world = modelMatrix * vec4(position, 1.0);
  place = world.xz;
  gl_Position = projectionMatrix * viewMatrix * world;
}`;

const FRAGMENT = `
uniform vec3 color;
uniform vec2 center;
uniform float cell, reach, strength;
varying vec2 place;
float lines(float size) {
  vec2 grid = place / size;
  vec2 width = fwidth(grid);
  vec2 near = abs(fract(grid - 0.5) - 0.5) / max(width, vec2(1e-6));
  // Lines closer than a few pixels melt into the floor.
  return (1.0 - min(min(near.x, near.y), 1.0)) * (1.0 - smoothstep(0.1, 0.4, max(width.x, width.y)));
}
void main() {
  float fade = 1.0 - smoothstep(0.25, 1.0, length(place - center) / reach);
  float alpha = max(0.45 * lines(cell), lines(10.0 * cell)) * fade * strength;
  if (alpha < 0.004) discard;
  gl_FragColor = vec4(color, alpha);
}`;

export class Floor {
  constructor() {
    this.uniforms = {
      color: { value: new THREE.Color(0x5a6478) },
      center: { value: new THREE.Vector2() },
      cell: { value: 0.1 },
      reach: { value: 3 },
      strength: { value: 0.5 },
    };
    const plane = new THREE.PlaneGeometry(1, 1).rotateX(-Math.PI / 2);
    this.grid = new THREE.Mesh(plane, new THREE.ShaderMaterial({
      uniforms: this.uniforms, vertexShader: VERTEX, fragmentShader: FRAGMENT,
      transparent: true, depthWrite: false, side: THREE.DoubleSide,
    }));
    this.shade = new THREE.Mesh(plane, new THREE.ShadowMaterial({ opacity: 0.2, depthWrite: false }));
    this.shade.receiveShadow = true;
    this.group = new THREE.Group();
    this.group.add(this.shade, this.grid);
  }

  place(center, y, radius) {
    this.group.position.set(center.x, y - 0.002 * radius, center.z);
    this.group.scale.set(14 * radius, 1, 14 * radius);
    this.uniforms.center.value.set(center.x, center.z);
    this.uniforms.reach.value = 5 * radius;
    this.uniforms.cell.value = 10 ** Math.floor(Math.log10(radius * 0.5));
  }

  paint(dark) {
    this.uniforms.color.value.set(dark ? 0xaab4cc : 0x4a5468);
    this.uniforms.strength.value = dark ? 0.2 : 0.21;
    this.shade.material.opacity = dark ? 0.45 : 0.2;
  }
}
