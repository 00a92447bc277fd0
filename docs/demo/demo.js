// The page: asks the worker, and shows its answers.
import { View, dot, rowsOf, sum } from "./view.js";

const byId = (id) => document.getElementById(id);
const FORMATS = ["stl", "obj", "ply", "off", "glb", "gltf", "3mf", "tesdf"];
const COLOURS = { a: [0.46, 0.52, 0.6], b: [0.2, 0.45, 0.72] };
const SLICE_SIDE = 192;
// Contacts are shown up to this distance, as a share of the diagonal.
const NEAR = 4e-3;

function fail(message) {
  byId("failure").hidden = false;
  byId("failure").textContent = message;
}

// The worker, whose calls are promises.
let worker;
let waiting = new Map();
let calls = 0;
function begin() {
  worker?.terminate();
  waiting.forEach(({ reject }) => reject(new Error("stopped")));
  waiting = new Map();
  worker = new Worker("worker.js", { type: "module" });
  worker.onerror = (event) => {
    const built = "Run crates/tesdf-web/build.sh in a clone of tesdf: it makes docs/demo/pkg, which has the program.";
    fail(`The program could not be loaded. ${built}\n${event.message ?? ""}`);
  };
  worker.onmessage = ({ data }) => {
    if (data.ready) return document.body.classList.add("ready");
    if (data.failed) return fail(`The program could not be loaded: ${data.failed}`);
    if (data.stage) return showStage(data);
    const { resolve, reject } = waiting.get(data.id);
    waiting.delete(data.id);
    if (data.error !== undefined) reject(new Error(data.error));
    else resolve(data);
  };
}
function ask(call, more = {}, moved = []) {
  const id = ++calls;
  return new Promise((resolve, reject) => {
    waiting.set(id, { resolve, reject });
    worker.postMessage({ id, call, ...more }, moved);
  });
}

const view = new View(byId("view"));
// What is shown: the size and middle of the first body, and the pose of the second.
const state = { size: 1, middle: [0, 0, 0], unit: null, place: [0, 0, 0], turns: [0, 0, 0], loaded: false, file: null };

let drawing = false;
function draw() {
  if (drawing) return;
  drawing = true;
  requestAnimationFrame(() => {
    drawing = false;
    const panel = byId("panel").getBoundingClientRect();
    view.camera.covered = panel.width < innerWidth * 0.6 ? panel.right / innerWidth : 0;
    view.draw();
  });
}

function length(x) {
  const [factor, unit] = state.unit === "m" ? [1000, " mm"] : [1, ""];
  const value = factor * x;
  const text = Math.abs(value) >= 1e-3 || value === 0 ? value.toPrecision(4) : value.toExponential(2);
  return text.replace("-", "−") + unit;
}

// Quaternion of turns about x, y and z, in this order.
function quaternion([x, y, z]) {
  const times = ([a, b, c, d], [e, f, g, h]) => [d * e + a * h + b * g - c * f, d * f - a * g + b * h + c * e, d * g + a * f - b * e + c * h, d * h - a * e - b * f - c * g];
  const about = (k, angle) => [0, 1, 2].map((i) => (i === k ? Math.sin(angle / 2) : 0)).concat(Math.cos(angle / 2));
  return times(about(2, z), times(about(1, y), about(0, x)));
}

const toView = (p) => sum(p, state.middle, -1).map((x) => x / state.size);
const pose = () => [...state.place, ...quaternion(state.turns)];

// Only the newest wish is computed, when the worker has time.
function latest(work) {
  let [running, again] = [false, false];
  return async function run() {
    if (running) return void (again = true);
    running = true;
    try {
      await work();
    } catch (error) {
      if (error.message !== "stopped") fail(error.message);
    }
    running = false;
    if (again) {
      again = false;
      run();
    }
  };
}

const updateSlice = latest(async () => {
  const shown = byId("cut").checked;
  if (view.slice) view.slice.shown = shown;
  if (!shown || !state.loaded) return draw();
  const axis = Number(byId("axis").value);
  const [u, v] = [(axis + 1) % 3, (axis + 2) % 3];
  const side = (k) => [0, 1, 2].map((i) => (i === k ? 1.3 * state.size : 0));
  const at = [0, 1, 2].map((k) => (k === axis ? Number(byId("place").value) : -0.65) * state.size + state.middle[k]);
  const wish = { corner: at, across: side(u), down: side(v), columns: SLICE_SIDE, rows: SLICE_SIDE };
  const answer = await ask("slice", wish);
  if (!state.loaded) return;
  view.setSlice(toView(at), side(u).map((x) => x / state.size), side(v).map((x) => x / state.size), answer, 1 / state.size);
  state.distances = answer.distances;
  draw();
});

const updatePair = latest(async () => {
  const body = view.bodies.b;
  if (!body || !state.loaded) return;
  const shown = byId("second").checked;
  Object.assign(body, { shown, rows: rowsOf(quaternion(state.turns)) });
  // The place of the body's own middle of coordinates.
  body.place = sum(sum(state.place, state.middle, -1), turned(body.rows, state.middle)).map((x) => x / state.size);
  draw();
  if (!shown) {
    [view.marks, view.lines] = [[], []];
    return;
  }
  const found = await ask("pair", { pose: pose(), near: NEAR * state.size });
  if (state.loaded) showPair(found);
});
const turned = (rows, v) => rows.map((row) => dot(row, v));

// Yellow where bodies touch, red and violet where they overlap, blue where they are apart.
function contactColour(distance) {
  const share = (x) => Math.sqrt(Math.min(Math.max(x, 0), 1));
  const mix = (a, b, s) => a.map((x, k) => x * (1 - s) + b[k] * s);
  const touching = [0.98, 0.72, 0.1];
  const s = distance / (NEAR * state.size);
  return s >= 0 ? mix(touching, [0.1, 0.6, 0.66], share(s)) : mix(touching, [0.78, 0.06, 0.12], share(-0.5 * s));
}

function showPair({ distance, witnesses, points, normals, distances, ms }) {
  [view.marks, view.lines] = [[], []];
  for (let k = 0; k < distances.length; k++) {
    const [p, n] = [points, normals].map((all) => [...all.subarray(3 * k, 3 * k + 3)]);
    const colour = [...contactColour(distances[k]), 1];
    view.marks.push(...toView(p), ...colour);
    view.lines.push(...toView(p), ...colour, ...sum(toView(p), n, 0.05), ...colour);
  }
  const [p, q] = [witnesses.slice(0, 3), witnesses.slice(3)];
  const dark = [0.08, 0.1, 0.14, 1];
  view.lines.push(...toView(p), ...dark, ...toView(q), ...dark);
  view.marks.push(...toView(p), ...dark, ...toView(q), ...dark);
  const put = (id, text, bad = false) => {
    byId(id).textContent = text;
    byId(id).classList.toggle("bad", bad);
  };
  put("clearance", length(distance), distance < 0);
  put("contacts", String(distances.length));
  const deepest = distances.reduce((least, d) => Math.min(least, d), 0);
  put("deepest", distances.length === 0 ? "–" : length(-deepest), deepest < 0);
  put("time", `${ms.toFixed(ms < 10 ? 1 : 0)} ms`);
  document.body.dataset.contacts = distances.length;
  document.body.dataset.clearance = distance;
  document.body.dataset.shown = Number(document.body.dataset.shown ?? 0) + 1;
  draw();
}

function showStage({ which, stage, share, part: [from, to] }) {
  const names = { refine: "bisecting the space", tighten: "shortening lists", assemble: "laying out the file" };
  byId("bar").value = from + (to - from) * ({ refine: 0, tighten: 0.25, assemble: 0.98 }[stage] + share * { refine: 0.25, tighten: 0.73, assemble: 0.02 }[stage]);
  byId("stage").textContent = `${which === "a" ? "first" : "second"} body: ${names[stage]}`;
}

function busy(on) {
  byId("about").hidden = false;
  byId("work").hidden = !on;
  ["sample", "choose", "save"].forEach((id) => (byId(id).disabled = on));
  if (on) {
    byId("bar").removeAttribute("value");
    byId("stage").textContent = "";
    byId("asset").textContent = "";
  }
}

function show({ a, b }, name, unit, place) {
  const [low, high] = [a.bounds.slice(0, 3), a.bounds.slice(3)].map((p) => [...p]);
  Object.assign(state, { middle: sum(low, high).map((x) => x / 2), size: Math.hypot(...sum(high, low, -1)), unit, loaded: true });
  const scaled = (triangles) => triangles.map((x, k) => (x - state.middle[k % 3]) / state.size);
  view.setBody("a", scaled(a.triangles), COLOURS.a);
  view.setBody("b", scaled(b.triangles), COLOURS.b);
  Object.assign(state, { place: place ?? [1.05 * (high[0] - low[0]), 0, 0], turns: [0, 0, 0], bytes: a.bytes, name });
  const took = a.seconds + (b === a ? 0 : b.seconds);
  const faces = b === a ? a.faces : a.faces + b.faces;
  const bytes = b === a ? a.bytes.length : a.bytes.length + b.bytes.length;
  const count = (n) => n.toLocaleString("en");
  byId("asset").textContent = `${count(faces)} faces, ${count(Math.round(bytes / 1000))} kB${took > 0 ? `, encoded in ${took.toFixed(1)} s (preset fast)` : ""}`;
  byId("ticks").children[0].textContent = length(-0.2 * state.size);
  byId("ticks").children[2].textContent = length(0.2 * state.size);
  ["slice", "pair", "save"].forEach((id) => (byId(id).hidden = false));
  makePose();
  updateSlice();
  updatePair();
  document.body.dataset.loaded = name;
}

// Sliders for the place, in diagonals from where the body is now, and for the turns.
function makePose() {
  byId("pose").replaceChildren();
  const rows = [0, 1, 2].map((k) => ["xyz"[k], -1.5, 1.5, () => (state.place[k] ) / state.size, (x) => (state.place[k] = x * state.size), () => length(state.place[k])]);
  rows.push(...[0, 1, 2].map((k) => ["∠" + "xyz"[k], -Math.PI, Math.PI, () => state.turns[k], (x) => (state.turns[k] = x), () => `${((state.turns[k] * 180) / Math.PI).toFixed(1)}°`]));
  state.shownPose = rows.map(([name, min, max, get, set, text]) => {
    const label = Object.assign(document.createElement("label"), { textContent: name });
    const slider = Object.assign(document.createElement("input"), { type: "range", min, max, step: 1e-4, value: get() });
    slider.setAttribute("aria-label", `${name} of the second body`);
    const output = document.createElement("output");
    slider.oninput = () => {
      set(Number(slider.value));
      showPose();
      updatePair();
    };
    byId("pose").append(label, slider, output);
    return () => {
      slider.value = get();
      output.textContent = text();
    };
  });
  showPose();
}
const showPose = () => state.shownPose.forEach((shown) => shown());

// Nothing is shown.
function clear() {
  state.loaded = false;
  ["slice", "pair", "save"].forEach((id) => (byId(id).hidden = true));
  view.bodies = {};
  [view.marks, view.lines, view.slice] = [[], [], null];
  draw();
}

function showReport(report) {
  const { faces, vertices, shells, encodable, defects } = report;
  byId("verdict").textContent = `${faces.toLocaleString("en")} faces, ${vertices.toLocaleString("en")} vertices, ${shells} ${shells === 1 ? "shell" : "shells"}. ${encodable ? "It has a well-defined inside." : "It has no well-defined inside:"}`;
  byId("verdict").classList.toggle("bad", !encodable);
  const items = defects.slice(0, 8).map(({ severity, message }) => Object.assign(document.createElement("li"), { textContent: `${severity}: ${message}` }));
  if (defects.length > 8) items.push(Object.assign(document.createElement("li"), { textContent: `and ${defects.length - 8} more` }));
  byId("defects").replaceChildren(...items);
  byId("mend").hidden = encodable;
}

async function work(name, task) {
  byId("failure").hidden = true;
  byId("name").textContent = name;
  busy(true);
  try {
    await task();
  } catch (error) {
    if (error.message !== "stopped") {
      byId("verdict").textContent = error.message;
      byId("verdict").classList.add("bad");
    }
  }
  busy(false);
}

function loadSample() {
  return work("M16 bolt and nut", async () => {
    state.file = null;
    byId("mend").hidden = true;
    byId("defects").replaceChildren();
    byId("verdict").classList.remove("bad");
    byId("verdict").textContent = "Made here: a bolt of ISO 4014 and a nut of ISO 4032 with 0.1 mm of play.";
    const wish = new URLSearchParams(location.search);
    const more = Object.fromEntries(["segments", "length"].filter((key) => wish.has(key)).map((key) => [key, Number(wish.get(key))]));
    const found = await ask("encodeSample", more);
    // Six pitches up the thread, with most of the play used up at one side.
    show(found, "M16 bolt and nut", "m", [3e-5, 0, 0.012]);
  });
}

function loadFile(file) {
  const format = file.name.split(".").pop().toLowerCase();
  return work(file.name, async () => {
    if (!FORMATS.includes(format)) throw new Error(`.${format} is no format that this page reads; expected ${FORMATS.map((name) => "." + name).join(", ")}`);
    const bytes = new Uint8Array(await file.arrayBuffer());
    byId("defects").replaceChildren();
    if (format === "tesdf") {
      byId("mend").hidden = true;
      byId("verdict").classList.remove("bad");
      byId("verdict").textContent = "An asset.";
      return show(await ask("open", { bytes }), file.name, null);
    }
    const isNew = state.file?.file !== file;
    state.file = { file };
    if (isNew) byId("repair").checked = false;
    const { report } = await ask("check", { bytes, name: file.name });
    showReport(report);
    if (!report.encodable && !byId("repair").checked) return clear();
    const found = await ask("encodeFile", { bytes, name: file.name, repair: byId("repair").checked });
    if (found.changed) byId("verdict").textContent += " It was repaired.";
    show(found, file.name, null);
  });
}

byId("sample").onclick = loadSample;
byId("choose").onclick = () => byId("file").click();
byId("file").onchange = () => byId("file").files[0] && loadFile(byId("file").files[0]);
byId("repair").onchange = () => byId("repair").checked && state.file && loadFile(state.file.file);
byId("stop").onclick = () => {
  // A worker that computes hears nothing; a new one has no bodies.
  begin();
  clear();
  byId("verdict").textContent = "Stopped.";
};
byId("save").onclick = () => {
  const link = document.createElement("a");
  link.href = URL.createObjectURL(new Blob([state.bytes], { type: "application/octet-stream" }));
  link.download = `${state.name.replace(/\.[^.]*$/, "").replaceAll(" ", "-")}.tesdf`;
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 1000);
};
["cut", "axis", "place"].forEach((id) => byId(id).addEventListener("input", updateSlice));
byId("second").oninput = updatePair;

addEventListener("dragover", (event) => {
  event.preventDefault();
  document.body.classList.add("dropping");
});
addEventListener("dragleave", () => document.body.classList.remove("dropping"));
addEventListener("drop", (event) => {
  event.preventDefault();
  document.body.classList.remove("dropping");
  if (event.dataTransfer.files[0]) loadFile(event.dataTransfer.files[0]);
});

// The mouse: the second body moves in the plane of the picture, the slice along its normal.
const canvas = byId("view");
let held = null;
canvas.addEventListener("pointerdown", (event) => {
  canvas.setPointerCapture(event.pointerId);
  const found = event.shiftKey || event.button > 0 ? { what: "move" } : view.under(event.clientX, event.clientY);
  held = { ...found, x: event.clientX, y: event.clientY };
  if (found.point) held.height = view.camera.height(found.ray.from, found.point);
  canvas.classList.add("dragged");
});
canvas.addEventListener("pointermove", (event) => {
  if (!held) return tell(event);
  const [dx, dy] = [event.clientX - held.x, event.clientY - held.y].map((d) => d / canvas.clientHeight);
  [held.x, held.y] = [event.clientX, event.clientY];
  const { right, up } = view.camera.axes;
  if (held.what === "b") {
    const moved = sum(right.map((x) => x * dx), up, -dy).map((x) => x * held.height * state.size);
    state.place = sum(state.place, moved);
    showPose();
    updatePair();
  } else if (held.what === "slice") {
    const { normal } = view.slice;
    const [x, y] = [dot(normal, right), -dot(normal, up)];
    const along = (x * dx + y * dy) / Math.max(x * x + y * y, 0.05);
    byId("place").value = Number(byId("place").value) + along * held.height;
    updateSlice();
  } else if (held.what === "move") {
    view.camera.move(dx, -dy);
    draw();
  } else {
    view.camera.turn(4 * dx, 4 * dy);
    draw();
  }
});
for (const name of ["pointerup", "pointercancel"]) {
  canvas.addEventListener(name, () => {
    held = null;
    canvas.classList.remove("dragged");
  });
}
canvas.addEventListener("contextmenu", (event) => event.preventDefault());
canvas.addEventListener("wheel", (event) => {
  event.preventDefault();
  const lines = event.deltaMode === 1 ? 30 : 1;
  view.camera.zoom(Math.exp(Math.min(Math.max(event.deltaY * lines, -240), 240) / 600));
  draw();
}, { passive: false });
canvas.addEventListener("keydown", (event) => {
  const turns = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] }[event.key];
  if (!turns) return;
  event.preventDefault();
  view.camera.turn(0.1 * turns[0], 0.1 * turns[1]);
  draw();
});
// The distance under the mouse.
function tell(event) {
  if (!view.slice?.shown || !state.distances) return;
  const { what, u, v } = view.under(event.clientX, event.clientY);
  const at = (share) => Math.min(Math.floor(share * SLICE_SIDE), SLICE_SIDE - 1);
  byId("under").textContent = what === "slice" ? `Here: ${length(state.distances[at(v) * SLICE_SIDE + at(u)])}` : "";
}
addEventListener("resize", draw);
// For tests.
window.tesdfUnder = (x, y) => view.under(x, y).what;

begin();
draw();
