// Draws a scan with three.js, and maps between its vertices and the canvas.

import "./three.min.js";
import { boundsOf } from "./scan-data.js";
import { planeGrid } from "./scan-grid.js";
import { ScanOrbit } from "./scan-orbit.js";
import { SCAN_FRAGMENT_SHADER, SCAN_VERTEX_SHADER } from "./scan-shaders.js";

/** Colour of the wood, sRGB from 0 to 1. */
const WOOD = [0.76, 0.6, 0.42];

export class ScanScene {
  /** Draws `scan`, as `decodeScan` returns it, on a canvas. Throws if there is no WebGL 2. */
  constructor(canvas, scan) {
    const { Group, PerspectiveCamera, Scene, WebGLRenderer } = globalThis.THREE;
    this.canvas = canvas;
    this.scan = scan;
    this.renderer = new WebGLRenderer({ canvas, antialias: true, alpha: true });
    this.scene = new Scene();
    this.camera = new PerspectiveCamera();
    this.group = new Group();
    this.scene.add(this.group);
    const bounds = boundsOf(scan.positions);
    this.orbit = new ScanOrbit(bounds);
    this.addScan();
    const { mesh, gridStep } = planeGrid(bounds);
    this.grid = mesh;
    this.gridStep = gridStep;
    this.group.add(mesh);
  }

  addScan() {
    const { BufferAttribute, BufferGeometry, DoubleSide, Mesh, Points, ShaderMaterial, Vector3 } = globalThis.THREE;
    const { header, positions, textureCoordinates, heights, corners, print, masks } = this.scan;
    const geometry = new BufferGeometry();
    geometry.setAttribute("position", new BufferAttribute(positions, 3));
    geometry.setAttribute("uv", new BufferAttribute(textureCoordinates, 2));
    geometry.setAttribute("height", new BufferAttribute(heights, 1));
    if (header.triangles > 0) {
      geometry.setIndex(new BufferAttribute(corners, 1));
      geometry.computeVertexNormals();
    } else {
      const upwards = Float32Array.from(positions, (value, i) => (i % 3 === 2 ? 1 : 0));
      geometry.setAttribute("normal", new BufferAttribute(upwards, 3));
    }
    const value = (initial) => ({ value: initial });
    this.uniforms = {
      print: value(textureOf(print, this.renderer)), masks: value(textureOf(masks, this.renderer)),
      wood: value(new Vector3(...WOOD)), light: value(new Vector3(0, 0, 1)), shading: value(1), ink: value(0),
      exaggeration: value(1), pointSize: value(3), threshold: value(header.threshold),
      showsThreshold: value(false), showsStrokes: value(false), showsInkOutline: value(false),
    };
    const material = new ShaderMaterial({
      uniforms: this.uniforms,
      vertexShader: SCAN_VERTEX_SHADER,
      fragmentShader: SCAN_FRAGMENT_SHADER,
      side: DoubleSide,
    });
    this.object = header.triangles > 0 ? new Mesh(geometry, material) : new Points(geometry, material);
    this.object.frustumCulled = false;
    this.group.add(this.object);
  }

  /** Applies the settings of the panel. */
  apply(settings) {
    const { uniforms } = this;
    for (const name of ["ink", "shading", "exaggeration", "threshold", "showsThreshold", "showsStrokes", "showsInkOutline"]) {
      uniforms[name].value = settings[name];
    }
    const [from, height] = [settings.lightDirection, settings.lightHeight].map((degrees) => (degrees * Math.PI) / 180);
    uniforms.light.value.set(Math.cos(height) * Math.cos(from), Math.cos(height) * Math.sin(from), Math.sin(height));
    this.grid.visible = settings.showsPlane;
    this.orbit.isMirrored = settings.asPrinted;
    // The reflection of the group also reverses the winding, which three.js takes into account.
    this.group.scale.x = settings.asPrinted ? -1 : 1;
  }

  render() {
    const { clientWidth: width, clientHeight: height } = this.canvas;
    if (width === 0 || height === 0) return;
    const ratio = Math.min(devicePixelRatio || 1, 2);
    if (this.canvas.width !== Math.floor(width * ratio) || this.canvas.height !== Math.floor(height * ratio)) {
      this.renderer.setPixelRatio(ratio);
      this.renderer.setSize(width, height, false);
    }
    this.uniforms.pointSize.value = Math.max(2, ratio * 2.5 * Math.sqrt(this.orbit.zoom));
    this.orbit.apply(this.camera, width / height);
    this.renderer.render(this.scene, this.camera);
  }

  /** Returns the position of a vertex as drawn, in the frame of the scene. */
  placeOf(vertex) {
    const { positions, heights } = this.scan;
    const [x, y, z] = positions.subarray(3 * vertex, 3 * vertex + 3);
    const raised = z + (this.uniforms.exaggeration.value - 1) * heights[vertex];
    return [x * this.group.scale.x, y, raised];
  }

  /** Returns the point of the canvas in CSS pixels at which a vertex is drawn. */
  project(vertex) {
    const { clientWidth, clientHeight } = this.canvas;
    const { x, y } = new globalThis.THREE.Vector3(...this.placeOf(vertex)).project(this.camera);
    return { x: ((x + 1) / 2) * clientWidth, y: ((1 - y) / 2) * clientHeight };
  }

  /**
   * Returns the colour [r, g, b, a] of the canvas at a point in CSS pixels. It must be called in the task that draws,
   * because the browser then clears the canvas.
   */
  pixel(x, y) {
    const context = this.renderer.getContext();
    const ratio = this.canvas.width / this.canvas.clientWidth;
    const colour = new Uint8Array(4);
    const row = this.canvas.height - 1 - Math.floor(y * ratio);
    context.readPixels(Math.floor(x * ratio), row, 1, 1, context.RGBA, context.UNSIGNED_BYTE, colour);
    return [...colour];
  }

  /** Returns the surface at a point in CSS pixels: height, print pixel (null beside the print); null beside the scan. */
  pick(x, y) {
    const { Vector3 } = globalThis.THREE;
    const { clientWidth, clientHeight } = this.canvas;
    const at = (z) => new Vector3((2 * x) / clientWidth - 1, 1 - (2 * y) / clientHeight, z).unproject(this.camera);
    const [start, end] = [at(-1), at(1)];
    const hit = nearestHit(this, start.toArray(), end.sub(start).normalize().toArray());
    if (!hit) return null;
    const { corners, heights, textureCoordinates, header } = this.scan;
    const mean = (values, size, k) =>
      hit.weights.reduce((sum, weight, i) => sum + weight * values[size * corners[3 * hit.triangle + i] + k], 0);
    const [u, v] = [mean(textureCoordinates, 2, 0), mean(textureCoordinates, 2, 1)];
    const isOnPrint = u >= 0 && u <= 1 && v >= 0 && v <= 1;
    const pixel = isOnPrint ? [u * header.print_size[0] - 0.5, v * header.print_size[1] - 0.5] : null;
    return { height: mean(heights, 1, 0), pixel };
  }

  /** Frees the memory of the graphics card. */
  dispose() {
    for (const { geometry, material } of [this.object, this.grid]) {
      geometry.dispose();
      material.dispose();
    }
    for (const name of ["print", "masks"]) this.uniforms[name].value.dispose();
    this.renderer.dispose();
    this.renderer.forceContextLoss();
  }
}

/** Returns a texture that keeps the values of a bitmap. The first row of the bitmap has v = 0. */
function textureOf(bitmap, renderer) {
  const { LinearFilter, LinearMipmapLinearFilter, NoColorSpace, Texture } = globalThis.THREE;
  const texture = new Texture(bitmap);
  texture.flipY = false;
  texture.colorSpace = NoColorSpace;
  texture.magFilter = LinearFilter;
  texture.minFilter = LinearMipmapLinearFilter;
  texture.anisotropy = Math.min(8, renderer.capabilities.getMaxAnisotropy());
  texture.needsUpdate = true;
  return texture;
}

/** Returns the nearest triangle on a ray with the weights of its corners (Möller and Trumbore 1997); null if none. */
function nearestHit(scene, start, direction) {
  const { corners, header } = scene.scan;
  const minus = (a, b) => [a[0] - b[0], a[1] - b[1], a[2] - b[2]];
  const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
  const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
  let nearest = null;
  for (let triangle = 0; triangle < header.triangles; triangle++) {
    const [a, b, c] = [0, 1, 2].map((i) => scene.placeOf(corners[3 * triangle + i]));
    const [ab, ac, from] = [minus(b, a), minus(c, a), minus(start, a)];
    const across = cross(direction, ac);
    const determinant = dot(ab, across);
    if (determinant === 0) continue;
    const second = dot(from, across) / determinant;
    if (second < 0 || second > 1) continue;
    const turned = cross(from, ab);
    const third = dot(direction, turned) / determinant;
    if (third < 0 || second + third > 1) continue;
    const distance = dot(ac, turned) / determinant;
    if (distance > 0 && (!nearest || distance < nearest.distance)) {
      nearest = { triangle, distance, weights: [1 - second - third, second, third] };
    }
  }
  return nearest;
}
