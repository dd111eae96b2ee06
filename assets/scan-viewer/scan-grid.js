// The fitted plane as a translucent grid.

import "./three.min.js";
import { GRID_FRAGMENT_SHADER, GRID_VERTEX_SHADER } from "./scan-shaders.js";

/** Returns 1, 2 or 5 times a power of ten, about a twelfth of a length. */
export function gridStepOf(length) {
  const power = 10 ** Math.floor(Math.log10(length / 12));
  return [1, 2, 5, 10].map((factor) => factor * power).find((step) => step >= length / 12);
}

/** Returns a square grid in the plane z = 0 that covers a box. Its lines pass through the origin. */
export function planeGrid({ low, high }) {
  const { BufferAttribute, BufferGeometry, DoubleSide, Mesh, ShaderMaterial } = globalThis.THREE;
  const margin = 0.03 * Math.max(high[0] - low[0], high[1] - low[1]);
  const [left, right, bottom, top] = [low[0] - margin, high[0] + margin, low[1] - margin, high[1] + margin];
  const corners = [left, bottom, 0, right, bottom, 0, right, top, 0, left, top, 0];
  const geometry = new BufferGeometry();
  geometry.setAttribute("position", new BufferAttribute(new Float32Array(corners), 3));
  geometry.setIndex([0, 1, 2, 0, 2, 3]);
  const gridStep = gridStepOf(Math.max(high[0] - low[0], high[1] - low[1]));
  const material = new ShaderMaterial({
    uniforms: { gridStep: { value: gridStep } },
    vertexShader: GRID_VERTEX_SHADER,
    fragmentShader: GRID_FRAGMENT_SHADER,
    side: DoubleSide,
    transparent: true,
    depthWrite: false,
  });
  return { mesh: new Mesh(geometry, material), gridStep };
}
