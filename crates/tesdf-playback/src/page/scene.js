// Draws the bodies, the floors, the contacts and the forces of a frame.

const SHADOW_SIZE = 2048;
// Length of the arrow of a contact and of the greatest force, in pixels of the page.
const CONTACT_LENGTH = 30;
const FORCE_LENGTH = 100;
const FORCE_COLOUR = [0.08, 0.3, 0.12];

class Program {
  constructor(gl, { vertex, fragment }) {
    this.program = gl.createProgram();
    for (const [type, text] of [[gl.VERTEX_SHADER, vertex], [gl.FRAGMENT_SHADER, fragment]]) {
      const shader = gl.createShader(type);
      gl.shaderSource(shader, text);
      gl.compileShader(shader);
      gl.attachShader(this.program, shader);
    }
    gl.linkProgram(this.program);
    if (!gl.getProgramParameter(this.program, gl.LINK_STATUS) && !gl.isContextLost()) {
      const logs = gl.getAttachedShaders(this.program).map((shader) => gl.getShaderInfoLog(shader));
      throw new Error(`the graphics card refuses a program: ${logs.join(" ")} ${gl.getProgramInfoLog(this.program)}`);
    }
    this.at = new Map();
    for (let k = 0; k < gl.getProgramParameter(this.program, gl.ACTIVE_UNIFORMS); k++) {
      const { name } = gl.getActiveUniform(this.program, k);
      this.at.set(name.replace("[0]", ""), gl.getUniformLocation(this.program, name));
    }
  }

  get(name) {
    return this.at.get(name) ?? null;
  }
}

// An arrow along z with length 1, whose point is at the origin's far end.
function arrowMesh() {
  const [sides, thin, wide, neck] = [12, 0.045, 0.14, 0.62];
  const [positions, directions] = [[], []];
  const put = (p, d) => {
    positions.push(...p);
    directions.push(...d);
  };
  for (let k = 0; k < sides; k++) {
    const [a, b] = [k, k + 1].map((i) => (2 * Math.PI * i) / sides).map((t) => [Math.cos(t), Math.sin(t)]);
    const ring = (t, radius, z) => [radius * t[0], radius * t[1], z];
    const out = (t) => [t[0], t[1], 0];
    const shaft = [[a, 0], [b, 0], [b, neck], [a, 0], [b, neck], [a, neck]];
    shaft.forEach(([t, z]) => put(ring(t, thin, z), out(t)));
    const head = (t) => unit([t[0], t[1], wide / (1 - neck)]);
    put(ring(a, wide, neck), head(a));
    put(ring(b, wide, neck), head(b));
    put([0, 0, 1], head(a));
    [ring(b, wide, neck), ring(a, wide, neck), [0, 0, neck]].forEach((p) => put(p, [0, 0, -1]));
  }
  return { positions, directions };
}

// Yellow where bodies touch, red and violet where they overlap, blue where they are apart.
function contactColour(gap, deep, apart) {
  const share = (value, most) => (most > 0 ? Math.sqrt(Math.min(Math.max(value / most, 0), 1)) : 0);
  const mix = (a, b, s) => a.map((x, k) => x * (1 - s) + b[k] * s);
  const touching = [0.98, 0.72, 0.1];
  if (gap >= 0) return mix(touching, [0.1, 0.6, 0.66], share(gap, apart));
  const s = 2 * share(-gap, deep);
  return mix(mix(touching, [0.9, 0.16, 0.14], Math.min(s, 1)), [0.42, 0, 0.22], Math.max(s - 1, 0));
}

class Scene {
  constructor(canvas, run) {
    const gl = canvas.getContext("webgl2", { antialias: true, alpha: true });
    if (!gl) throw new Error("this browser has no WebGL 2, which draws the bodies");
    Object.assign(this, { gl, canvas, run, hidden: new Set(), highlighted: -1, showContacts: !run.forces, showForces: true });
    this.programs = {};
    for (const [name, texts] of Object.entries({ BODY, DEPTH, SHADE, FLOOR, ARROW })) {
      this.programs[name] = new Program(gl, texts);
    }
    this.instances = gl.createBuffer();
    this.meshes = run.meshes.map((mesh) => this.mesh(mesh));
    this.groups = run.meshes.map(() => []);
    run.bodies.forEach((body, number) => {
      if (body.mesh !== null) this.groups[body.mesh].push(number);
    });
    this.floor = gl.createVertexArray();
    gl.bindVertexArray(this.floor);
    this.attribute(0, 2, new Float32Array([-1, -1, 1, -1, -1, 1, 1, 1]));
    this.makeArrows();
    this.makeShadowMap();
    this.makeLook();
    gl.enable(gl.DEPTH_TEST);
    gl.blendFunc(gl.ONE, gl.ONE_MINUS_SRC_ALPHA);
    const { right, up, forward } = axesOf(AZIMUTH, ELEVATION);
    this.lamp = unit(right.map((_, k) => -0.55 * right[k] + 0.35 * up[k] - 0.75 * forward[k] + (k === 2 ? 0.8 : 0)));
  }

  attribute(location, size, values, type = this.gl.FLOAT, normalized = false) {
    const { gl } = this;
    gl.bindBuffer(gl.ARRAY_BUFFER, gl.createBuffer());
    gl.bufferData(gl.ARRAY_BUFFER, values, gl.STATIC_DRAW);
    gl.enableVertexAttribArray(location);
    gl.vertexAttribPointer(location, size, type, normalized, 0, 0);
  }

  mesh({ positions, normals, indices }) {
    const { gl } = this;
    const array = gl.createVertexArray();
    gl.bindVertexArray(array);
    this.attribute(0, 3, positions);
    this.attribute(1, 2, normals, gl.SHORT, true);
    gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, gl.createBuffer());
    gl.bufferData(gl.ELEMENT_ARRAY_BUFFER, indices, gl.STATIC_DRAW);
    for (let location = 2; location < 6; location++) {
      gl.enableVertexAttribArray(location);
      gl.vertexAttribDivisor(location, 1);
    }
    return { array, count: indices.length };
  }

  makeArrows() {
    const { gl } = this;
    const { positions, directions } = arrowMesh();
    this.arrows = gl.createVertexArray();
    gl.bindVertexArray(this.arrows);
    this.attribute(0, 3, new Float32Array(positions));
    this.attribute(1, 3, new Float32Array(directions));
    this.arrowCorners = positions.length / 3;
    this.arrowInstances = gl.createBuffer();
    gl.bindBuffer(gl.ARRAY_BUFFER, this.arrowInstances);
    [2, 3, 4].forEach((location, k) => {
      gl.enableVertexAttribArray(location);
      gl.vertexAttribPointer(location, 3, gl.FLOAT, false, 36, 12 * k);
      gl.vertexAttribDivisor(location, 1);
    });
  }

  makeShadowMap() {
    const { gl } = this;
    this.shadowMap = gl.createTexture();
    gl.bindTexture(gl.TEXTURE_2D, this.shadowMap);
    gl.texStorage2D(gl.TEXTURE_2D, 1, gl.DEPTH_COMPONENT24, SHADOW_SIZE, SHADOW_SIZE);
    gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_COMPARE_MODE, gl.COMPARE_REF_TO_TEXTURE);
    gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MIN_FILTER, gl.LINEAR);
    gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MAG_FILTER, gl.LINEAR);
    this.shadows = gl.createFramebuffer();
    gl.bindFramebuffer(gl.FRAMEBUFFER, this.shadows);
    gl.framebufferTexture2D(gl.FRAMEBUFFER, gl.DEPTH_ATTACHMENT, gl.TEXTURE_2D, this.shadowMap, 0);
  }

  // The pixel under the mouse: the number of the body, and its depth.
  makeLook() {
    const { gl } = this;
    const texture = gl.createTexture();
    gl.bindTexture(gl.TEXTURE_2D, texture);
    gl.texStorage2D(gl.TEXTURE_2D, 1, gl.RG32UI, 1, 1);
    const depth = gl.createRenderbuffer();
    gl.bindRenderbuffer(gl.RENDERBUFFER, depth);
    gl.renderbufferStorage(gl.RENDERBUFFER, gl.DEPTH_COMPONENT24, 1, 1);
    this.looks = gl.createFramebuffer();
    gl.bindFramebuffer(gl.FRAMEBUFFER, this.looks);
    gl.framebufferTexture2D(gl.FRAMEBUFFER, gl.COLOR_ATTACHMENT0, gl.TEXTURE_2D, texture, 0);
    gl.framebufferRenderbuffer(gl.FRAMEBUFFER, gl.DEPTH_ATTACHMENT, gl.RENDERBUFFER, depth);
  }

  // Puts the bodies at a time between two frames.
  place(camera, frame, share) {
    const { gl, run } = this;
    const rows = (body, target) => {
      const { position, turn } = poseAt(body, run.times.length, frame, share);
      return rowsOf(turn).map((row, k) => [...row.map((x) => x * body.scale), position[k] - target[k]]);
    };
    const values = [];
    this.drawn = [];
    this.ranges = this.groups.map((group) => {
      const first = this.drawn.length;
      for (const number of group.filter((number) => !this.hidden.has(number))) {
        const body = run.bodies[number];
        values.push(...rows(body, camera.target).flat(), ...body.colour, number === this.highlighted ? 1 : 0);
        this.drawn.push(number);
      }
      return { first, count: this.drawn.length - first };
    });
    this.floors = run.bodies
      .map((body, number) => ({ body, number }))
      .filter(({ body, number }) => body.mesh === null && !this.hidden.has(number))
      .map(({ body }) => ({ body, rows: rows(body, camera.target) }));
    gl.bindBuffer(gl.ARRAY_BUFFER, this.instances);
    gl.bufferData(gl.ARRAY_BUFFER, new Float32Array(values), gl.DYNAMIC_DRAW);
  }

  drawBodies(program) {
    const { gl } = this;
    gl.bindBuffer(gl.ARRAY_BUFFER, this.instances);
    this.ranges.forEach(({ first, count }, k) => {
      if (count === 0) return;
      gl.bindVertexArray(this.meshes[k].array);
      for (let row = 0; row < 4; row++) {
        gl.vertexAttribPointer(2 + row, 4, gl.FLOAT, false, 64, 64 * first + 16 * row);
      }
      gl.uniform1ui(program.get("first"), first);
      gl.drawElementsInstanced(gl.TRIANGLES, this.meshes[k].count, gl.UNSIGNED_INT, 0, count);
    });
  }

  // Distance from the target within which things are seen.
  reach(camera) {
    return Math.hypot(...sum(camera.target, this.run.middle, -1)) + 2.5 * this.run.diagonal;
  }

  // The matrix from positions relative to the target to the map of shadows.
  lampView(camera) {
    const z = this.lamp;
    const x = unit(cross([0, 0, 1], z));
    const axes = [x, cross(z, x), z.map((c) => -c)];
    const radius = 0.6 * this.run.diagonal;
    const middle = sum(this.run.middle, camera.target, -1);
    const matrix = [0, 1, 2].flatMap((k) => [...axes.map((axis) => axis[k] / radius), 0]);
    return matrix.concat(axes.map((axis) => -dot(axis, middle) / radius), 1);
  }

  draw(camera, frame, share) {
    const { gl, canvas, run } = this;
    const ratio = Math.min(window.devicePixelRatio || 1, 2);
    const [width, height] = [canvas.clientWidth, canvas.clientHeight].map((side) => Math.max(1, Math.round(side * ratio)));
    if (canvas.width !== width || canvas.height !== height) Object.assign(canvas, { width, height });
    const view = camera.view(width / height, this.reach(camera));
    const lampView = this.lampView(camera);
    this.place(camera, frame, share);

    const { BODY, SHADE } = this.programs;
    gl.bindFramebuffer(gl.FRAMEBUFFER, this.shadows);
    gl.viewport(0, 0, SHADOW_SIZE, SHADOW_SIZE);
    gl.clear(gl.DEPTH_BUFFER_BIT);
    gl.useProgram(SHADE.program);
    gl.uniformMatrix4fv(SHADE.get("view"), false, lampView);
    this.drawBodies(SHADE);

    gl.bindFramebuffer(gl.FRAMEBUFFER, null);
    gl.viewport(0, 0, width, height);
    gl.clearColor(0, 0, 0, 0);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    gl.bindTexture(gl.TEXTURE_2D, this.shadowMap);
    const { right, forward } = camera.axes;
    const use = (program) => {
      gl.useProgram(program.program);
      gl.uniformMatrix4fv(program.get("view"), false, view);
      gl.uniformMatrix4fv(program.get("lampView"), false, lampView);
      gl.uniform1f(program.get("lampStep"), (1.2 * run.diagonal) / SHADOW_SIZE);
    };
    use(BODY);
    gl.uniform3fv(BODY.get("eye"), forward.map((x) => -x * camera.distance));
    gl.uniform3fv(BODY.get("lamp"), this.lamp);
    gl.uniform3fv(BODY.get("side"), unit(sum(right.map((x) => 0.7 * x), forward, -1)));
    this.drawBodies(BODY);

    gl.enable(gl.BLEND);
    this.drawFloors(use, camera);
    const nearest = share < 0.5 ? frame : Math.min(frame + 1, run.times.length - 1);
    if (run.contacts && this.showContacts) this.drawArrows(use, camera, this.contactArrows(nearest), height / ratio);
    if (run.forces && this.showForces) this.drawArrows(use, camera, this.forceArrows(nearest), height / ratio);
    gl.disable(gl.BLEND);
  }

  drawFloors(use, camera) {
    const { gl, run } = this;
    const { FLOOR } = this.programs;
    use(FLOOR);
    gl.uniform1f(FLOOR.get("square"), run.square);
    gl.uniform1f(FLOOR.get("diagonal"), run.diagonal);
    gl.uniform1f(FLOOR.get("reach"), 1.6 * run.diagonal);
    gl.bindVertexArray(this.floor);
    const eye = camera.axes.forward.map((x) => -x * camera.distance);
    for (const { body, rows } of this.floors) {
      // The rows of a plane have its scale, but a floor is in metres.
      const turn = rows.map((row) => row.slice(0, 3).map((x) => x / body.scale));
      const normal = turn.map((row) => row[2]);
      const place = rows.map((row) => row[3]);
      // From below, a floor does not hide what lies on it.
      if (dot(normal, sum(eye, place, -1)) <= 0) continue;
      gl.uniform4fv(FLOOR.get("rows"), turn.flatMap((row, k) => [...row, place[k]]));
      gl.uniform3fv(FLOOR.get("normal"), normal);
      gl.uniform2fv(FLOOR.get("phase"), body.phase);
      gl.drawArrays(gl.TRIANGLE_STRIP, 0, 4);
    }
  }

  // Arrows: where they begin, their vector in pixels, and their colour.
  contactArrows(frame) {
    const { starts, points, normals, distances, most_deep: deep, most_apart: apart } = this.run.contacts;
    const arrows = [];
    for (let k = starts[frame]; k < starts[frame + 1]; k++) {
      const normal = ofOctahedron(normals[2 * k], normals[2 * k + 1]);
      const vector = normal.map((x) => CONTACT_LENGTH * x);
      arrows.push(...points.subarray(3 * k, 3 * k + 3), ...vector, ...contactColour(distances[k], deep, apart));
    }
    return arrows;
  }

  forceArrows(frame) {
    const { frames, greatest } = this.run.forces;
    const { points, vectors } = frames[frame];
    const arrows = [];
    for (let k = 0; k < points.length; k += 3) {
      const [point, force] = [points, vectors].map((all) => [...all.slice(k, k + 3)]);
      const vector = force.map((x) => (FORCE_LENGTH * x) / greatest);
      if (dot(vector, vector) > 0) arrows.push(...point, ...vector, ...FORCE_COLOUR);
    }
    return arrows;
  }

  drawArrows(use, camera, arrows, height) {
    const { gl } = this;
    const { ARROW } = this.programs;
    use(ARROW);
    gl.uniform3fv(ARROW.get("target"), camera.target);
    gl.uniform3fv(ARROW.get("towards"), camera.axes.forward.map((x) => -x));
    gl.uniform1f(ARROW.get("pixel"), (2 * HALF_VIEW) / height);
    gl.uniform1f(ARROW.get("thick"), CONTACT_LENGTH);
    gl.bindVertexArray(this.arrows);
    gl.bindBuffer(gl.ARRAY_BUFFER, this.arrowInstances);
    gl.bufferData(gl.ARRAY_BUFFER, new Float32Array(arrows), gl.DYNAMIC_DRAW);
    const draw = (alpha) => {
      gl.uniform1f(ARROW.get("alpha"), alpha);
      gl.drawArraysInstanced(gl.TRIANGLES, 0, this.arrowCorners, arrows.length / 9);
    };
    // Faint where a body hides them, then those that are seen.
    gl.depthMask(false);
    gl.depthFunc(gl.GREATER);
    draw(0.3);
    gl.depthMask(true);
    gl.depthFunc(gl.LESS);
    draw(1);
  }

  // The body at a place of the page, and the point of its surface relative to the target.
  look(camera, x, y) {
    const { gl, canvas } = this;
    if (!this.drawn) return null;
    const { DEPTH } = this.programs;
    const [width, height] = [canvas.clientWidth, canvas.clientHeight];
    const aspect = canvas.width / canvas.height;
    const [u, v] = [(2 * x) / width - 1, 1 - (2 * y) / height];
    const view = camera.view(aspect, this.reach(camera));
    // Only the pixel at (u, v) is drawn: it becomes the whole picture.
    for (let column = 0; column < 4; column++) {
      const w = view[4 * column + 3];
      view[4 * column] = (view[4 * column] - u * w) * width;
      view[4 * column + 1] = (view[4 * column + 1] - v * w) * height;
    }
    gl.bindFramebuffer(gl.FRAMEBUFFER, this.looks);
    gl.viewport(0, 0, 1, 1);
    gl.clearBufferuiv(gl.COLOR, 0, [0xffffffff, 0, 0, 0]);
    gl.clearBufferfv(gl.DEPTH, 0, [1]);
    gl.useProgram(DEPTH.program);
    gl.uniformMatrix4fv(DEPTH.get("view"), false, view);
    this.drawBodies(DEPTH);
    const found = new Uint32Array(4);
    gl.readPixels(0, 0, 1, 1, gl.RGBA_INTEGER, gl.UNSIGNED_INT, found);
    gl.bindFramebuffer(gl.FRAMEBUFFER, null);
    if (found[0] === 0xffffffff) return null;
    const depth = new Float32Array(found.buffer)[1];
    return { body: this.drawn[found[0]], point: camera.point(u, v, depth, aspect, this.reach(camera)) };
  }
}
