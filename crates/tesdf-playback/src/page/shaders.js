// The programs of the graphics card. Positions are relative to the point that the camera looks at,
// so that a close view of a large scene stays precise. Colours are in linear light.

const ENCODE = `
vec3 encode(vec3 light) {
  vec3 c = clamp(light, 0.0, 1.0);
  return mix(12.92 * c, 1.055 * pow(c, vec3(1.0 / 2.4)) - 0.055, step(0.0031308, c));
}`;

// A body's rows are its rotation with scale, and its position.
const PLACED = `#version 300 es
layout(location = 0) in vec3 position;
layout(location = 1) in vec2 octahedron;
layout(location = 2) in vec4 row0;
layout(location = 3) in vec4 row1;
layout(location = 4) in vec4 row2;
layout(location = 5) in vec4 tint;
vec3 placed(vec3 p) {
  vec4 q = vec4(p, 1.0);
  return vec3(dot(row0, q), dot(row1, q), dot(row2, q));
}
vec3 turned(vec3 n) {
  return normalize(vec3(dot(row0.xyz, n), dot(row1.xyz, n), dot(row2.xyz, n)));
}`;

// The share of the lamp's light that arrives, from nine depths of the map around the point.
const SHADOW = `
uniform highp sampler2DShadow shadowMap;
uniform mat4 lampView;
uniform float lampStep;
float lit(vec3 p, vec3 n) {
  vec3 q = (lampView * vec4(p + 2.2 * lampStep * n, 1.0)).xyz * 0.5 + 0.5;
  if (any(lessThan(q, vec3(0.0))) || any(greaterThan(q, vec3(1.0)))) return 1.0;
  float sum = 0.0;
  vec2 texel = 1.0 / vec2(textureSize(shadowMap, 0));
  for (int x = -1; x <= 1; x++)
    for (int y = -1; y <= 1; y++)
      sum += texture(shadowMap, vec3(q.xy + 1.3 * vec2(x, y) * texel, q.z - 0.0008));
  return sum / 9.0;
}`;

const BODY = {
  vertex: `${PLACED}
uniform mat4 view;
out vec3 at;
out vec3 normal;
out vec4 colour;
void main() {
  vec3 n = vec3(octahedron, 1.0 - abs(octahedron.x) - abs(octahedron.y));
  if (n.z < 0.0) n.xy = (1.0 - abs(n.yx)) * mix(vec2(-1.0), vec2(1.0), greaterThanEqual(n.xy, vec2(0.0)));
  at = placed(position);
  normal = turned(n);
  colour = tint;
  gl_Position = view * vec4(at, 1.0);
}`,
  fragment: `#version 300 es
precision highp float;
in vec3 at;
in vec3 normal;
in vec4 colour;
uniform vec3 eye;
uniform vec3 lamp;
uniform vec3 side;
out vec4 result;
${ENCODE}
${SHADOW}
void main() {
  vec3 along = normalize(at - eye);
  vec3 n = normalize(normal);
  if (dot(n, along) > 0.0) n = reflect(n, along);
  float falls = max(dot(n, lamp), 0.0);
  float open = falls > 0.0 ? lit(at, n) : 0.0;
  vec3 ambient = mix(vec3(0.27, 0.265, 0.26), vec3(0.42, 0.445, 0.49), 0.5 + 0.5 * n.z);
  vec3 light = ambient + vec3(0.96, 0.94, 0.90) * falls * open + vec3(0.20, 0.21, 0.23) * max(dot(n, side), 0.0);
  float gloss = pow(max(dot(n, normalize(lamp - along)), 0.0), 48.0) * open * 0.20;
  float grazing = pow(1.0 + min(dot(n, along), 0.0), 4.0) * 0.10;
  vec3 seen = colour.rgb * light + gloss + grazing;
  result = vec4(encode(mix(seen, vec3(1.0), 0.18 * colour.a)), 1.0);
}`,
};

// Bodies seen from the lamp, and for the mouse: the number of the body and its depth.
const DEPTH = {
  vertex: `${PLACED}
uniform mat4 view;
uniform uint first;
flat out uint body;
void main() {
  body = first + uint(gl_InstanceID);
  gl_Position = view * vec4(placed(position), 1.0);
}`,
  fragment: `#version 300 es
precision highp float;
precision highp int;
flat in uint body;
layout(location = 0) out uvec2 result;
void main() {
  result = uvec2(body, floatBitsToUint(gl_FragCoord.z));
}`,
};

const SHADE = { vertex: DEPTH.vertex, fragment: `#version 300 es
void main() {}` };

// A floor of squares, which fades with the distance from the middle of the scene.
const FLOOR = {
  vertex: `#version 300 es
layout(location = 0) in vec2 corner;
uniform mat4 view;
uniform vec4 rows[3];
uniform float reach;
out vec3 at;
out vec2 inside;
void main() {
  inside = corner * reach;
  vec4 q = vec4(inside, 0.0, 1.0);
  at = vec3(dot(rows[0], q), dot(rows[1], q), dot(rows[2], q));
  gl_Position = view * vec4(at, 1.0);
}`,
  fragment: `#version 300 es
precision highp float;
in vec3 at;
in vec2 inside;
uniform vec3 normal;
uniform vec2 phase;
uniform float square;
uniform float diagonal;
out vec4 result;
${ENCODE}
${SHADOW}
float stripes(float x, float width) {
  // The mean of a square wave over a pixel.
  float w = max(width, 1e-6);
  vec2 ends = fract(0.5 * vec2(x - 0.5 * w, x + 0.5 * w));
  vec2 area = abs(ends - 0.5) * 2.0;
  return clamp((area.y - area.x) / w, -1.0, 1.0);
}
void main() {
  vec2 p = (inside + phase) / square;
  vec2 w = fwidth(p);
  float pattern = 0.5 + 0.5 * stripes(p.x, w.x) * stripes(p.y, w.y);
  vec3 tile = mix(vec3(0.73, 0.76, 0.80), vec3(0.87, 0.885, 0.91), pattern);
  float open = lit(at, normal);
  float seen = 1.0 - smoothstep(0.6, 1.6, length(inside) / diagonal);
  result = vec4(encode(tile * (0.55 + 0.45 * open)), 1.0) * seen;
}`,
};

// Arrows from a point along a vector in pixels.
const ARROW = {
  vertex: `#version 300 es
layout(location = 0) in vec3 position;
layout(location = 1) in vec3 direction;
layout(location = 2) in vec3 point;
layout(location = 3) in vec3 along;
layout(location = 4) in vec3 tint;
uniform mat4 view;
uniform vec3 target;
uniform float pixel;
uniform float thick;
out vec3 colour;
out vec3 facing;
void main() {
  vec3 base = point - target;
  float unit = pixel * (view * vec4(base, 1.0)).w;
  float size = length(along);
  vec3 normal = along / size;
  vec3 u = normalize(cross(normal, abs(normal.z) < 0.9 ? vec3(0, 0, 1) : vec3(1, 0, 0)));
  vec3 v = cross(normal, u);
  mat3 turn = mat3(u, v, normal);
  facing = turn * direction;
  // A long arrow is not thicker than that of a contact.
  vec3 sized = vec3(vec2(min(size, thick)), size) * position;
  gl_Position = view * vec4(base + turn * sized * unit, 1.0);
  colour = tint;
}`,
  fragment: `#version 300 es
precision highp float;
in vec3 colour;
in vec3 facing;
uniform vec3 towards;
uniform float alpha;
out vec4 result;
${ENCODE}
void main() {
  float light = 0.6 + 0.4 * max(dot(normalize(facing), towards), 0.0);
  result = vec4(encode(colour * light), 1.0) * alpha;
}`,
};
