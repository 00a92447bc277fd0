"use strict";
// Decodes the run: its description as JSON, and its numbers, which are deflated and in base64.

// Inflates the numbers. Each array of 32-bit words is stored as differences of successive words,
// first the lowest bytes of all of them, then the next ones.
async function readNumbers(text) {
  const deflated = Uint8Array.from(atob(text), (c) => c.charCodeAt(0));
  const stream = new Blob([deflated]).stream().pipeThrough(new DecompressionStream("deflate"));
  const bytes = new Uint8Array(await new Response(stream).arrayBuffer());
  let offset = 0;
  return (length) => {
    const words = new Uint32Array(length);
    let word = 0;
    for (let i = 0; i < length; i++) {
      const at = offset + i;
      word += bytes[at] | (bytes[at + length] << 8) | (bytes[at + 2 * length] << 16) | (bytes[at + 3 * length] << 24);
      words[i] = word;
    }
    offset += 4 * length;
    return words;
  };
}

const floats = (words) => new Float32Array(words.buffer);

// The run with its arrays. They are in the order in which the file was written.
async function readRun() {
  const run = JSON.parse(document.getElementById("run").textContent);
  const take = await readNumbers(document.getElementById("data").textContent);
  for (const mesh of run.meshes) {
    mesh.positions = floats(take(3 * mesh.vertices));
    mesh.normals = new Int16Array(take(mesh.vertices).buffer);
    mesh.indices = take(mesh.corners);
  }
  const frames = run.times.length;
  for (const body of run.bodies) {
    const columns = floats(take(7 * frames));
    body.track = columns.map((_, at) => columns[(at % 7) * frames + Math.floor(at / 7)]);
  }
  if (run.contacts) {
    const { contacts } = run;
    contacts.starts = take(frames + 1);
    contacts.found = take(frames);
    contacts.deepest = floats(take(frames));
    const count = contacts.starts[frames];
    contacts.points = floats(take(3 * count));
    contacts.normals = new Int16Array(take(count).buffer);
    contacts.distances = floats(take(count));
  }
  if (run.forces) {
    const { forces } = run;
    forces.starts = take(frames + 1);
    forces.found = take(frames);
    const count = forces.starts[frames];
    const [points, vectors] = [floats(take(3 * count)), floats(take(3 * count))];
    const of = (all, frame) => all.subarray(3 * forces.starts[frame], 3 * forces.starts[frame + 1]);
    forces.frames = run.times.map((_, k) => {
      return { step: forces.steps[k], found: forces.found[k], points: of(points, k), vectors: of(vectors, k) };
    });
  }
  return run;
}

// The unit vector of a point of the octahedron, two numbers of 16 bits.
function ofOctahedron(x, y) {
  x /= 32767;
  y /= 32767;
  const z = 1 - Math.abs(x) - Math.abs(y);
  if (z < 0) {
    [x, y] = [(1 - Math.abs(y)) * (x < 0 ? -1 : 1), (1 - Math.abs(x)) * (y < 0 ? -1 : 1)];
  }
  const length = Math.hypot(x, y, z);
  return [x / length, y / length, z / length];
}

// A run that is still made: each message has a frame. Calls back after each one, and at the end.
function follow(run, grown) {
  const begin = run.bodies.map((body) => [...body.track]);
  run.bodies.forEach((body, number) => (body.track = begin[number]));
  run.forces = { frames: [{ step: null, found: 0, points: [], vectors: [] }], greatest: 0 };
  const source = new EventSource("frames");
  source.addEventListener("message", ({ data }) => {
    const { time, step, poses, forces } = JSON.parse(data);
    run.times.push(time);
    run.steps.push(step);
    run.bodies.forEach((body, number) => body.track.push(...poses.slice(7 * number, 7 * number + 7)));
    const { points, vectors, found } = forces ?? { points: [], vectors: [], found: 0 };
    run.forces.frames.push({ step: step - 1, found, points, vectors });
    // The greatest one comes first.
    run.forces.greatest = Math.max(run.forces.greatest, Math.hypot(...vectors.slice(0, 3)));
    grown("The run is being made.");
  });
  source.addEventListener("error", () => grown("The program that makes the run does not answer."));
  source.addEventListener("end", () => {
    source.close();
    grown("The run has ended.");
  });
}

// Pose of a body between two frames: position relative to the centre of the run, and quaternion.
function poseAt(body, frames, frame, share) {
  const track = body.track;
  const next = Math.min(frame + 1, frames - 1);
  const value = (k) => track[7 * frame + k] * (1 - share) + track[7 * next + k] * share;
  const position = [value(0), value(1), value(2)];
  const turn = [value(3), value(4), value(5), value(6)];
  const length = Math.hypot(...turn) || 1;
  return { position, turn: turn.map((q) => q / length) };
}

// A number with its unit, in three digits. The units ascend from the smallest one.
function valueText(value, units) {
  const size = Math.abs(value);
  const [unit, name] = units.findLast(([unit]) => size >= 0.9995 * unit) ?? units[0];
  return size < 5e-3 * units[0][0] ? "0" : `${+(value / unit).toPrecision(3)} ${name}`.replace("-", "−");
}

const lengthText = (metres) => valueText(metres, [[1e-9, "nm"], [1e-6, "µm"], [1e-3, "mm"], [1, "m"]]);
const forceText = (newtons) => valueText(newtons, [[1e-6, "µN"], [1e-3, "mN"], [1, "N"], [1e3, "kN"], [1e6, "MN"]]);
