// Shaders of the scan. Colours are sRGB values throughout, so that an unlit scan has exactly the colours of the print.

/** Moves vertices by their height over the fitted surface. The normal of a surface z = f(x, y) changes accordingly. */
export const SCAN_VERTEX_SHADER = `
attribute float height;
uniform float exaggeration;
uniform float pointSize;
varying vec2 textureAt;
varying float heightAt;
varying vec3 normalAt;
varying vec3 placeAt;

void main() {
  vec3 place = position;
  place.z += (exaggeration - 1.0) * height;
  vec4 world = modelMatrix * vec4(place, 1.0);
  textureAt = uv;
  heightAt = height;
  normalAt = mat3(modelMatrix) * vec3(normal.xy, normal.z / exaggeration);
  placeAt = world.xyz;
  gl_Position = projectionMatrix * viewMatrix * world;
  gl_PointSize = pointSize;
}`;

export const SCAN_FRAGMENT_SHADER = `
uniform sampler2D print;
uniform sampler2D masks;
uniform vec3 wood;
uniform vec3 light;
uniform float shading;
uniform float ink;
uniform float threshold;
uniform bool showsThreshold;
uniform bool showsStrokes;
uniform bool showsInkOutline;
varying vec2 textureAt;
varying float heightAt;
varying vec3 normalAt;
varying vec3 placeAt;

/** Returns 1 on the line where a value passes a level, about two pixels wide. */
float line(float value, float level) {
  return 1.0 - smoothstep(0.0, 1.5, abs(value - level) / max(fwidth(value), 1e-6));
}

void main() {
  vec3 strokeColour = vec3(0.77, 0.31, 0.0);
  vec3 inkColour = vec3(0.0, 0.42, 0.85);
  vec3 aboveColour = vec3(0.0, 0.62, 0.5);
  vec3 colour = wood;
  bool isOnPrint = all(greaterThanEqual(textureAt, vec2(0.0))) && all(lessThanEqual(textureAt, vec2(1.0)));
  vec3 printed = texture2D(print, textureAt).rgb;
  vec2 mask = texture2D(masks, textureAt).rg;
  float outline = line(mask.g, 0.5) * step(0.02, mask.g) * step(mask.g, 0.98);
  float contour = line(heightAt, threshold);
  if (isOnPrint) {
    colour = mix(colour, printed, ink);
    if (showsStrokes) colour = mix(colour, strokeColour, 0.55 * mask.r);
    if (showsThreshold) colour = mix(colour, aboveColour, max(0.5 * step(threshold, heightAt), contour));
  }
  vec3 normal = normalize(normalAt);
  vec3 toCamera = normalize(cameraPosition - placeAt);
  if (dot(normal, toCamera) < 0.0) normal = -normal;
  // The plane keeps its brightness under a low light. A weak second light at the camera shows surfaces in shadow.
  float raking = 0.75 * max(dot(normal, light), 0.0) / (0.3 + 0.7 * light.z);
  float shade = 0.1 + 0.22 * dot(normal, toCamera) + raking;
  colour *= mix(1.0, min(shade, 1.35), shading);
  if (isOnPrint && showsInkOutline) colour = mix(colour, inkColour, outline);
  gl_FragColor = vec4(colour, 1.0);
}`;

export const GRID_VERTEX_SHADER = `
varying vec2 gridAt;

void main() {
  gridAt = position.xy;
  gl_Position = projectionMatrix * modelViewMatrix * vec4(position, 1.0);
}`;

export const GRID_FRAGMENT_SHADER = `
uniform float gridStep;
varying vec2 gridAt;

void main() {
  vec2 cell = gridAt / gridStep;
  vec2 distance = abs(fract(cell - 0.5) - 0.5) / fwidth(cell);
  float line = 1.0 - clamp(min(distance.x, distance.y) - 0.3, 0.0, 1.0);
  gl_FragColor = vec4(mix(vec3(0.35, 0.6, 0.95), vec3(0.1, 0.3, 0.7), line), mix(0.28, 0.85, line));
}`;
