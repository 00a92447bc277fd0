// Draws two bodies, a slice, contacts and the witnesses of the clearance; finds what is under the mouse.
// Positions are divided by the size of the first body, which is in the middle.

export const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
export const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
export const sum = (a, b, factor = 1) => a.map((x, k) => x + factor * b[k]);
export const unit = (a) => a.map((x) => x / (Math.hypot(...a) || 1));

// The rotation of a unit quaternion x y z w, as rows.
export function rowsOf([x, y, z, w]) {
  return [
    [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
    [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
    [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
  ];
}

// Half of the vertical field of view.
const HALF_VIEW = Math.tan((13 * Math.PI) / 180);
const REST = [[1, 0, 0], [0, 1, 0], [0, 0, 1]];

export class Camera {
  azimuth = (-60 * Math.PI) / 180;
  elevation = (22 * Math.PI) / 180;
  target = [0, 0, 0];
  distance = 3.4;
  // The share of the width at the left that the panel covers.
  covered = 0;

  get axes() {
    const { azimuth, elevation } = this;
    const level = [Math.cos(azimuth), Math.sin(azimuth), 0];
    const right = [-level[1], level[0], 0];
    const forward = sum(level.map((x) => -x * Math.cos(elevation)), [0, 0, -Math.sin(elevation)]);
    return { right, up: cross(right, forward), forward };
  }

  turn(right, up) {
    this.azimuth -= right;
    this.elevation = Math.min(Math.max(this.elevation + up, -1.55), 1.55);
  }

  // By shares of the height of the picture.
  move(right, up) {
    const { right: x, up: y } = this.axes;
    const height = 2 * HALF_VIEW * this.distance;
    this.target = sum(sum(this.target, x, -right * height), y, -up * height);
  }

  zoom(factor) {
    this.distance = Math.min(Math.max(this.distance * factor, 0.02), 60);
  }

  matrix(aspect) {
    const { right, up, forward } = this.axes;
    const [near, far] = [Math.max(this.distance - 3, 0.02 * this.distance), this.distance + 6];
    const [a, b] = [(far + near) / (far - near), (-2 * far * near) / (far - near)];
    const at = (axis) => -dot(axis, this.target);
    const d = this.distance;
    const rows = [
      [right.map((x, k) => x / (HALF_VIEW * aspect) + this.covered * forward[k]), at(right) / (HALF_VIEW * aspect) + this.covered * (at(forward) + d)],
      [up.map((x) => x / HALF_VIEW), at(up) / HALF_VIEW],
      [forward.map((x) => a * x), a * (at(forward) + d) + b],
      [forward, at(forward) + d],
    ];
    return new Float32Array([0, 1, 2].flatMap((k) => rows.map(([row]) => row[k])).concat(rows.map(([, last]) => last)));
  }

  // The ray through a place of the picture, from -1 to 1.
  ray(x, y, aspect) {
    const { right, up, forward } = this.axes;
    const from = sum(this.target, forward, -this.distance);
    const across = sum(right.map((r) => r * (x - this.covered) * HALF_VIEW * aspect), up, y * HALF_VIEW);
    return { from, along: unit(sum(across, forward)) };
  }

  // The length that a height of the picture has at a distance from the eye.
  height(from, point) {
    return 2 * HALF_VIEW * dot(sum(point, from, -1), this.axes.forward);
  }
}

const CUT = `
uniform vec4 cut;
bool isCut(vec3 p) { return dot(cut.xyz, p) > cut.w; }`;

const BODY = [
  `#version 300 es
layout(location = 0) in vec3 position;
uniform mat4 view;
uniform mat3 turn;
uniform vec3 place;
out vec3 at;
void main() {
  at = turn * position + place;
  gl_Position = view * vec4(at, 1.0);
}`,
  `#version 300 es
precision highp float;
in vec3 at;
uniform vec3 colour;
uniform vec3 eye;
uniform vec3 lamp;
${CUT}
out vec4 pixel;
void main() {
  if (isCut(at)) discard;
  vec3 n = normalize(cross(dFdx(at), dFdy(at)));
  vec3 out_ = normalize(eye - at);
  if (dot(n, out_) < 0.0) n = -n;
  float light = 0.34 + 0.5 * max(dot(n, lamp), 0.0) + 0.22 * max(dot(n, out_), 0.0);
  vec3 c = gl_FrontFacing ? colour : colour * 0.55;
  float gloss = pow(max(dot(n, normalize(lamp + out_)), 0.0), 40.0);
  pixel = vec4(pow(c * light + 0.12 * gloss, vec3(1.0 / 2.2)), 1.0);
}`,
];

const SLICE = [
  `#version 300 es
layout(location = 0) in vec2 corner;
uniform mat4 view;
uniform vec3 first;
uniform vec3 across;
uniform vec3 down;
out vec2 uv;
void main() {
  uv = corner * 0.5 + 0.5;
  gl_Position = view * vec4(first + uv.x * across + uv.y * down, 1.0);
}`,
  `#version 300 es
precision highp float;
in vec2 uv;
uniform sampler2D distances;
uniform float step_;
uniform float most;
out vec4 pixel;
void main() {
  float d = texture(distances, uv).r;
  float s = clamp(abs(d) / most, 0.0, 1.0);
  vec3 inside = mix(vec3(0.93, 0.95, 0.97), mix(vec3(0.37, 0.59, 0.81), vec3(0.07, 0.21, 0.42), clamp(2.0 * s - 1.0, 0.0, 1.0)), min(2.0 * s, 1.0));
  vec3 outside = mix(vec3(0.95, 0.93, 0.89), mix(vec3(0.88, 0.64, 0.29), vec3(0.54, 0.27, 0.06), clamp(2.0 * s - 1.0, 0.0, 1.0)), min(2.0 * s, 1.0));
  vec3 c = d < 0.0 ? inside : outside;
  float wide = fwidth(d);
  float line = abs(fract(d / step_ + 0.5) - 0.5) * step_;
  c *= mix(0.72, 1.0, smoothstep(0.4 * wide, 1.3 * wide, line));
  c = mix(vec3(0.08), c, smoothstep(0.6 * wide, 1.8 * wide, abs(d)));
  float alpha = d < 0.0 ? 1.0 : 0.86 * (1.0 - smoothstep(0.06, 0.3, d));
  pixel = vec4(c * alpha, alpha);
}`,
];

const MARK = [
  `#version 300 es
layout(location = 0) in vec3 position;
layout(location = 1) in vec4 tint;
uniform mat4 view;
uniform float size;
out vec4 colour;
void main() {
  colour = tint;
  gl_Position = view * vec4(position, 1.0);
  gl_PointSize = size;
}`,
  `#version 300 es
precision highp float;
in vec4 colour;
uniform float round;
uniform float alpha;
out vec4 pixel;
void main() {
  vec2 p = 2.0 * gl_PointCoord - 1.0;
  if (round > 0.5 && dot(p, p) > 1.0) discard;
  float a = colour.a * alpha;
  pixel = vec4(colour.rgb * a, a);
}`,
];

export class View {
  constructor(canvas) {
    const gl = canvas.getContext("webgl2", { antialias: true, alpha: true });
    if (!gl) throw new Error("this browser has no WebGL 2, which draws the bodies");
    Object.assign(this, { gl, canvas, camera: new Camera(), bodies: {}, marks: [], lines: [], slice: null });
    this.programs = Object.fromEntries(Object.entries({ BODY, SLICE, MARK }).map(([name, texts]) => [name, this.program(texts)]));
    this.quad = this.array([[0, 2, new Float32Array([-1, -1, 1, -1, -1, 1, 1, 1])]]);
    this.texture = gl.createTexture();
    gl.bindTexture(gl.TEXTURE_2D, this.texture);
    for (const [name, value] of [["MIN_FILTER", "LINEAR"], ["MAG_FILTER", "LINEAR"], ["WRAP_S", "CLAMP_TO_EDGE"], ["WRAP_T", "CLAMP_TO_EDGE"]]) {
      gl.texParameteri(gl.TEXTURE_2D, gl[`TEXTURE_${name}`], gl[value]);
    }
    this.markBuffer = gl.createBuffer();
    this.markArray = gl.createVertexArray();
    gl.bindVertexArray(this.markArray);
    gl.bindBuffer(gl.ARRAY_BUFFER, this.markBuffer);
    [[0, 3, 0], [1, 4, 12]].forEach(([location, size, offset]) => {
      gl.enableVertexAttribArray(location);
      gl.vertexAttribPointer(location, size, gl.FLOAT, false, 28, offset);
    });
    gl.enable(gl.DEPTH_TEST);
    gl.blendFunc(gl.ONE, gl.ONE_MINUS_SRC_ALPHA);
  }

  program(texts) {
    const { gl } = this;
    const program = gl.createProgram();
    texts.forEach((text, k) => {
      const shader = gl.createShader(k === 0 ? gl.VERTEX_SHADER : gl.FRAGMENT_SHADER);
      gl.shaderSource(shader, text);
      gl.compileShader(shader);
      gl.attachShader(program, shader);
      if (!gl.getShaderParameter(shader, gl.COMPILE_STATUS) && !gl.isContextLost()) throw new Error(`the graphics card refuses a program: ${gl.getShaderInfoLog(shader)}`);
    });
    gl.linkProgram(program);
    const at = {};
    for (let k = 0; k < gl.getProgramParameter(program, gl.ACTIVE_UNIFORMS); k++) {
      const { name } = gl.getActiveUniform(program, k);
      at[name] = gl.getUniformLocation(program, name);
    }
    return { program, at };
  }

  array(attributes) {
    const { gl } = this;
    const array = gl.createVertexArray();
    gl.bindVertexArray(array);
    for (const [location, size, values] of attributes) {
      gl.bindBuffer(gl.ARRAY_BUFFER, gl.createBuffer());
      gl.bufferData(gl.ARRAY_BUFFER, values, gl.STATIC_DRAW);
      gl.enableVertexAttribArray(location);
      gl.vertexAttribPointer(location, size, gl.FLOAT, false, 0, 0);
    }
    return array;
  }

  // `triangles` has the corners; `rows` and `place` say where the body is.
  setBody(name, triangles, colour) {
    this.bodies[name] = { array: this.array([[0, 3, triangles]]), triangles, colour, rows: REST, place: [0, 0, 0], shown: true };
  }

  setSlice(corner, across, down, { distances, columns, rows }, scale) {
    const { gl } = this;
    gl.bindTexture(gl.TEXTURE_2D, this.texture);
    gl.pixelStorei(gl.UNPACK_ALIGNMENT, 4);
    gl.texImage2D(gl.TEXTURE_2D, 0, gl.R16F, columns, rows, 0, gl.RED, gl.FLOAT, distances.map((d) => d * scale));
    this.slice = { corner, across, down, normal: unit(cross(across, down)), shown: true };
  }

  get aspect() {
    return this.canvas.clientWidth / Math.max(this.canvas.clientHeight, 1);
  }

  draw() {
    const { gl, canvas, camera, programs } = this;
    const ratio = Math.min(window.devicePixelRatio || 1, 2);
    const [width, height] = [canvas.clientWidth, canvas.clientHeight].map((side) => Math.max(1, Math.round(side * ratio)));
    if (canvas.width !== width || canvas.height !== height) Object.assign(canvas, { width, height });
    gl.viewport(0, 0, width, height);
    gl.clearColor(0, 0, 0, 0);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    const view = camera.matrix(this.aspect);
    const { right, up, forward } = camera.axes;
    const eye = sum(camera.target, forward, -camera.distance);
    const use = ({ program, at }) => {
      gl.useProgram(program);
      gl.uniformMatrix4fv(at.view, false, view);
      return at;
    };
    // The half of the bodies that is between the slice and the eye is taken away.
    const { slice } = this;
    const isCut = slice && slice.shown;
    let cut = [0, 0, 0, 1];
    if (isCut) {
      const side = dot(slice.normal, sum(eye, slice.corner, -1)) > 0 ? 1 : -1;
      cut = [...slice.normal.map((x) => side * x), side * dot(slice.normal, slice.corner)];
    }
    let at = use(programs.BODY);
    gl.uniform4fv(at.cut, cut);
    gl.uniform3fv(at.eye, eye);
    gl.uniform3fv(at.lamp, unit(right.map((_, k) => -0.5 * right[k] + 0.6 * up[k] - 0.6 * forward[k])));
    for (const body of Object.values(this.bodies).filter((body) => body.shown)) {
      gl.uniform3fv(at.colour, body.colour);
      gl.uniform3fv(at.place, body.place);
      gl.uniformMatrix3fv(at.turn, true, body.rows.flat());
      gl.bindVertexArray(body.array);
      gl.drawArrays(gl.TRIANGLES, 0, body.triangles.length / 3);
    }
    gl.enable(gl.BLEND);
    if (isCut) {
      at = use(programs.SLICE);
      ["first", "across", "down"].forEach((name, k) => gl.uniform3fv(at[name], [slice.corner, slice.across, slice.down][k]));
      gl.uniform1f(at.step_, 0.02);
      gl.uniform1f(at.most, 0.2);
      gl.bindTexture(gl.TEXTURE_2D, this.texture);
      gl.bindVertexArray(this.quad);
      gl.drawArrays(gl.TRIANGLE_STRIP, 0, 4);
    }
    at = use(programs.MARK);
    gl.bindVertexArray(this.markArray);
    gl.bindBuffer(gl.ARRAY_BUFFER, this.markBuffer);
    for (const [values, mode, size] of [[this.lines, gl.LINES, 1], [this.marks, gl.POINTS, 7 * ratio]]) {
      if (values.length === 0) continue;
      gl.bufferData(gl.ARRAY_BUFFER, new Float32Array(values), gl.DYNAMIC_DRAW);
      gl.uniform1f(at.size, size);
      gl.uniform1f(at.round, mode === gl.POINTS ? 1 : 0);
      // Faint where a body hides them, then those that are seen.
      gl.depthMask(false);
      gl.depthFunc(gl.GREATER);
      gl.uniform1f(at.alpha, 0.4);
      gl.drawArrays(mode, 0, values.length / 7);
      gl.depthFunc(gl.LEQUAL);
      gl.uniform1f(at.alpha, 1);
      gl.drawArrays(mode, 0, values.length / 7);
      gl.depthMask(true);
      gl.depthFunc(gl.LESS);
    }
    gl.disable(gl.BLEND);
  }

  // What is under a place of the page: { what, point }.
  under(x, y) {
    const { left, top, width, height } = this.canvas.getBoundingClientRect();
    const ray = this.camera.ray((2 * (x - left)) / width - 1, 1 - (2 * (y - top)) / height, this.aspect);
    const { slice } = this;
    const isCut = slice && slice.shown;
    const kept = (point) => {
      if (!isCut) return true;
      const side = dot(slice.normal, sum(ray.from, slice.corner, -1));
      return side * dot(slice.normal, sum(point, slice.corner, -1)) <= 1e-9;
    };
    let found = { what: null, t: Infinity };
    for (const [what, body] of Object.entries(this.bodies).filter(([, body]) => body.shown)) {
      const t = first(body, ray, kept);
      if (t < found.t) found = { what, t };
    }
    if (isCut) {
      const t = dot(slice.normal, sum(slice.corner, ray.from, -1)) / dot(slice.normal, ray.along);
      const at = sum(sum(ray.from, ray.along, t), slice.corner, -1);
      const [u, v] = [slice.across, slice.down].map((side) => dot(at, side) / dot(side, side));
      if (t > 0 && t < found.t + 1e-6 && u >= 0 && u <= 1 && v >= 0 && v <= 1) found = { what: "slice", t, u, v };
    }
    return { ...found, point: sum(ray.from, ray.along, found.t), ray };
  }
}

// Where a ray first meets a kept part of a body.
function first({ triangles, rows, place }, { from, along }, kept) {
  // The ray in the frame of the body.
  const back = (v) => [0, 1, 2].map((k) => rows[0][k] * v[0] + rows[1][k] * v[1] + rows[2][k] * v[2]);
  const [ox, oy, oz] = back(sum(from, place, -1));
  const [dx, dy, dz] = back(along);
  let best = Infinity;
  for (let k = 0; k < triangles.length; k += 9) {
    const [ax, ay, az] = [triangles[k], triangles[k + 1], triangles[k + 2]];
    const [ux, uy, uz] = [triangles[k + 3] - ax, triangles[k + 4] - ay, triangles[k + 5] - az];
    const [vx, vy, vz] = [triangles[k + 6] - ax, triangles[k + 7] - ay, triangles[k + 8] - az];
    const [px, py, pz] = [dy * vz - dz * vy, dz * vx - dx * vz, dx * vy - dy * vx];
    const determinant = ux * px + uy * py + uz * pz;
    if (determinant === 0) continue;
    const [sx, sy, sz] = [ox - ax, oy - ay, oz - az];
    const s = (sx * px + sy * py + sz * pz) / determinant;
    if (s < 0 || s > 1) continue;
    const [qx, qy, qz] = [sy * uz - sz * uy, sz * ux - sx * uz, sx * uy - sy * ux];
    const w = (dx * qx + dy * qy + dz * qz) / determinant;
    if (w < 0 || s + w > 1) continue;
    const t = (vx * qx + vy * qy + vz * qz) / determinant;
    if (t > 0 && t < best && kept(sum(from, along, t))) best = t;
  }
  return best;
}
