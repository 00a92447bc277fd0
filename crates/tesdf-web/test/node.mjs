// The package in node: its bytes are those of the table of all platforms, its classes work, and a bolt
// is encoded in time. Arguments: the folder of the package, that of the golden program, and hashes.txt.
import assert from "node:assert/strict";
import { readFile } from "node:fs/promises";
import { pathToFileURL } from "node:url";

const [folder, golden, table] = process.argv.slice(2);
async function load(folder) {
  const tesdf = await import(pathToFileURL(`${folder}/tesdf.js`));
  await tesdf.default({ module_or_path: await readFile(`${folder}/tesdf_bg.wasm`) });
  return tesdf;
}

// Bytes.
{
  const start = performance.now();
  const found = (await load(golden)).golden().trimEnd().split("\n");
  const expected = (await readFile(table, "utf8")).trimEnd().split("\n");
  assert.deepEqual(found, expected);
  console.log(`${found.length} golden hashes in ${((performance.now() - start) / 1000).toFixed(1)} s`);
}

const { Asset, Solid, check, clearance, contacts } = await load(folder);

// A cube, its check, its distances and its file.
const obj = (faces) => new TextEncoder().encode(`v -1 -1 -1\nv 1 -1 -1\nv 1 1 -1\nv -1 1 -1\nv -1 -1 1\nv 1 -1 1\nv 1 1 1\nv -1 1 1\n${faces}`);
const sides = ["1 4 3 2", "5 6 7 8", "1 2 6 5", "2 3 7 6", "3 4 8 7", "4 1 5 8"].map((side) => `f ${side}\n`);
const cube = new Solid(obj(sides.join("")), "cube.obj").encode();
assert.equal(cube.faceCount, 12);
assert.deepEqual([...cube.signedDistances(new Float64Array([0, 0, 0, 3, 0, 0, 2, 2, 1]))], [-1, 2, Math.SQRT2]);
assert.equal(cube.triangles().length, 12 * 9);
assert.deepEqual([...cube.bounds], [-1, -1, -1, 1, 1, 1]);
assert.deepEqual(Asset.open(cube.save()).save(), cube.save());
const slice = cube.slice([-2, -1, 0], [4, 0, 0], [0, 2, 0], 4, 2);
assert.deepEqual([...slice], [0.5, -0.5, -0.5, 0.5, 0.5, -0.5, -0.5, 0.5]);

// An open box is refused with the defects, and repaired on request.
const open = obj(sides.slice(1).join(""));
const report = check(open, "open.obj");
assert.equal(report.encodable, false);
assert.ok(report.defects.some(({ severity }) => severity === "error"));
assert.throws(() => new Solid(open, "open.obj"), /no well-defined inside.*repair/s);
const mended = new Solid(open, "open.obj", true);
assert.ok(mended.changed && mended.faceCount === 12);
assert.throws(() => new Solid(open, "part.step"), /Gmsh|STEP/i);
assert.throws(() => new Solid(open, "part.xyz"), /xyz/);
assert.throws(() => Asset.open(open), Error);

// Contacts and clearance.
const rest = [0, 0, 0, 0, 0, 0, 1];
const pose = (x) => [x, 0, 0, 0, 0, 0, 1];
assert.ok(Math.abs(clearance(cube, cube, pose(2.25), rest).distance - 0.25) < 1e-6);
const overlap = clearance(cube, cube, pose(1.75), rest);
assert.ok(Math.abs(overlap.distance + 0.25) < 1e-6 && overlap.overlap);
const found = contacts(cube, cube, pose(1.75), rest, { mode: "exact" });
assert.ok(found.length > 0 && Math.abs(Math.min(...found.distances) + 0.25) < 1e-6);
assert.ok(found.normals.every(Number.isFinite) && found.points.length === 3 * found.length);
assert.equal(contacts(cube, cube, pose(2.5), rest).length, 0);
assert.throws(() => contacts(cube, cube, [0], rest), /poseA has 1 numbers/);
assert.throws(() => contacts(cube, cube, rest, rest, { mode: "vertex" }), /vertex/);

// Progress goes forward, and the encoding can be stopped.
const bolt = Solid.bolt("M16", 0.03, 5e-5, 24);
const told = [];
bolt.encode("fast", (stage, share) => void told.push([stage, share]));
assert.deepEqual([...new Set(told.map(([stage]) => stage))], ["refine", "tighten", "assemble"]);
assert.ok(told.length > 20 && told.every(([, share]) => share >= 0 && share <= 1));
assert.throws(() => bolt.encode("fast", () => false), /stop|cancel/i);

// The bolt of the README, of 25,000 faces.
const large = Solid.bolt("M16", 0.08, 0, 51);
const before = process.cpuUsage();
const asset = large.encode();
const { user, system } = process.cpuUsage(before);
const seconds = (user + system) / 1e6;
console.log(`a bolt of ${large.faceCount} faces: ${seconds.toFixed(1)} s of a processor, ${asset.save().length} bytes`);
