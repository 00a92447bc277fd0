// Has the meshes and assets, and does all that takes time. A message is { id, call, … }; the answer is
// { id, … } or { id, error }.
import init, { Asset, Solid, check, clearance, contacts } from "./pkg/tesdf.js";

const bodies = {};

// The sample: an M16 bolt and its nut, in metres, with 0.1 mm of play.
function sample({ segments, length }) {
  return { a: Solid.bolt("M16", length, 5e-5, segments), b: Solid.nut("M16", 5e-5, segments) };
}

function put(which, asset, seconds) {
  bodies[which] = asset;
  const bytes = asset.save();
  return { faces: asset.faceCount, bounds: asset.bounds, triangles: asset.triangles(), bytes, seconds };
}

function encode(id, which, solid, preset, part) {
  const start = performance.now();
  const told = (stage, share) => postMessage({ id, which, stage, share, part });
  const asset = solid.encode(preset, told);
  return put(which, asset, (performance.now() - start) / 1000);
}

const calls = {
  check({ bytes, name }) {
    return { report: check(bytes, name) };
  },
  // Both bodies of a file are the same asset.
  encodeFile({ id, bytes, name, repair, preset = "fast" }) {
    const solid = new Solid(bytes, name, repair);
    const a = encode(id, "a", solid, preset, [0, 1]);
    bodies.b = bodies.a;
    return { a, b: a, changed: solid.changed };
  },
  encodeSample({ id, segments = 32, length = 0.03, preset = "fast" }) {
    const solids = sample({ segments, length });
    const faces = [solids.a.faceCount, solids.b.faceCount];
    const share = faces[0] / (faces[0] + faces[1]);
    const a = encode(id, "a", solids.a, preset, [0, share]);
    const b = encode(id, "b", solids.b, preset, [share, 1]);
    return { a, b };
  },
  open({ bytes }) {
    const a = put("a", Asset.open(bytes), 0);
    bodies.b = bodies.a;
    return { a, b: a };
  },
  slice({ corner, across, down, columns, rows }) {
    return { distances: bodies.a.slice(corner, across, down, columns, rows), columns, rows };
  },
  pair({ pose, near }) {
    const start = performance.now();
    const rest = [0, 0, 0, 0, 0, 0, 1];
    const apart = clearance(bodies.b, bodies.a, pose, rest);
    const options = { mode: "exact", contact_distance: near, reduction: { per_pair: 64 } };
    const found = contacts(bodies.b, bodies.a, pose, rest, options);
    const answer = {
      distance: apart.distance,
      witnesses: [...apart.pointA, ...apart.pointB],
      points: found.points,
      normals: found.normals,
      distances: found.distances,
    };
    [apart, found].forEach((object) => object.free());
    return { ...answer, ms: performance.now() - start };
  },
};

const ready = init().then(() => postMessage({ ready: true }));
ready.catch((error) => postMessage({ failed: String(error) }));
onmessage = async ({ data }) => {
  await ready;
  try {
    const answer = calls[data.call](data);
    postMessage({ id: data.id, ...answer });
  } catch (error) {
    postMessage({ id: data.id, error: error.message ?? String(error) });
  }
};
