// Writes the Utah teapot (M. Newell, 1975) as an OBJ file with open surfaces: the pictures of
// docs/meshes.md. Its patches come from three.js 0.187 (MIT), which .ci/chromium.sh puts into
// target/three; TESDF_THREE may name another folder.
//
//     node lab/scripts/teapot.mjs teapot.obj             # with its lid
//     node lab/scripts/teapot.mjs open.obj without-lid
import { writeFileSync } from "node:fs";
import { pathToFileURL } from "node:url";

const three = process.env.TESDF_THREE ?? "target/three/node_modules/three";
const { TeapotGeometry } = await import(pathToFileURL(`${three}/examples/jsm/geometries/TeapotGeometry.js`));

const [file, part] = process.argv.slice(2);
if (!file || (part && part !== "without-lid")) {
    console.error("usage: node lab/scripts/teapot.mjs FILE.obj [without-lid]");
    process.exit(2);
}
// Size, segments of a patch, bottom, lid, body, lid that meets the body.
const teapot = new TeapotGeometry(1, 8, true, part !== "without-lid", true, true);
const points = teapot.getAttribute("position"), corners = teapot.getIndex();
const lines = [];
for (let k = 0; k < points.count; k++) {
    lines.push(`v ${points.getX(k)} ${points.getY(k)} ${points.getZ(k)}`);
}
for (let k = 0; k < corners.count; k += 3) {
    lines.push(`f ${[0, 1, 2].map((c) => corners.getX(k + c) + 1).join(" ")}`);
}
writeFileSync(file, lines.join("\n") + "\n");
