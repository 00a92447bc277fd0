// The page docs/demo in headless Chromium: it encodes the sample in its worker, shows distances and
// contacts, and a dragged body changes them. Arguments: the folder of the page, the folder of
// playwright-core, and where pictures go. TESDF_CHROMIUM names Chromium.
import assert from "node:assert/strict";
import { createReadStream } from "node:fs";
import { mkdir, stat } from "node:fs/promises";
import { createServer } from "node:http";
import { createRequire } from "node:module";
import { extname, join, normalize } from "node:path";

const [folder, packages, pictures] = process.argv.slice(2);
const { chromium } = createRequire(`${packages}/`)("playwright-core");
const TYPES = { ".html": "text/html", ".js": "text/javascript", ".css": "text/css", ".wasm": "application/wasm" };
const server = createServer(async (request, answer) => {
  const path = join(folder, normalize(new URL(request.url, "http://x").pathname.replace(/\/$/, "/index.html")));
  if (!(await stat(path).catch(() => null))?.isFile()) return answer.writeHead(404).end();
  answer.writeHead(200, { "content-type": TYPES[extname(path)] ?? "application/octet-stream" });
  createReadStream(path).pipe(answer);
});
await new Promise((ready) => server.listen(0, "127.0.0.1", ready));
const address = `http://127.0.0.1:${server.address().port}/`;
await mkdir(pictures, { recursive: true });

// WebGL without a graphics card, and nothing that Chromium itself asks the network for.
const args = `--no-sandbox --use-angle=swiftshader --enable-unsafe-swiftshader --disable-quic --no-first-run
  --disable-background-networking --disable-component-update --disable-sync --force-color-profile=srgb`.split(/\s+/);
const browser = await chromium.launch({ executablePath: process.env.TESDF_CHROMIUM, args });
try {
  const page = await browser.newPage({ viewport: { width: 1200, height: 760 } });
  page.setDefaultTimeout(120000);
  const [said, asked] = [[], []];
  page.on("console", (message) => !message.text().includes("GPU stall") && said.push(message.text()));
  page.on("pageerror", (error) => said.push(String(error)));
  page.on("request", (request) => asked.push(request.url()));
  const picture = (name) => page.screenshot({ path: join(pictures, `${name}.png`) });
  const contacts = () => page.evaluate(() => Number(document.body.dataset.contacts));
  const clearance = () => page.evaluate(() => Number(document.body.dataset.clearance));
  const settled = async (test) => {
    for (let k = 0; k < 600; k++) {
      if (await test()) return;
      await page.waitForTimeout(50);
    }
    throw new Error(`this did not come true: ${test}`);
  };

  await page.goto(`${address}?segments=16`);
  await page.waitForSelector("body.ready, #failure:not([hidden])", { state: "attached" });
  assert.equal(await page.textContent("#failure"), "");
  await picture("start");
  await page.click("#sample");
  await page.waitForSelector("#work:not([hidden])");
  await settled(() => page.evaluate(() => document.getElementById("bar").value > 0.1));
  await picture("encoding");
  await page.waitForSelector("body[data-loaded]", { timeout: 120000 });
  await settled(async () => (await contacts()) > 0);
  await page.waitForTimeout(500);
  await picture("sample");
  assert.match(await page.textContent("#asset"), /faces, .* kB, encoded in/);

  // The nut is dragged off the bolt: clearance grows, contacts go.
  const before = await clearance();
  await page.evaluate(() => {
    const slider = document.querySelector('#pose input[aria-label^="x of"]');
    slider.value = 0.6;
    slider.dispatchEvent(new Event("input"));
  });
  await settled(async () => (await clearance()) > before + 1e-3);
  assert.equal(await contacts(), 0);
  await page.waitForTimeout(300);
  await picture("apart");

  // With the mouse, to the left, until it overlaps.
  const spot = page.viewportSize();
  const found = await page.evaluate(({ width, height }) => {
    // The rightmost place where the second body is.
    for (let x = width - 5; x > 0; x -= 8) {
      for (let y = 5; y < height; y += 8) if (window.tesdfUnder(x, y) === "b") return [x, y];
    }
    return null;
  }, spot);
  assert.ok(found, "the second body is in the picture");
  const [x, y] = found;
  await page.mouse.move(x, y);
  await page.mouse.down();
  for (let k = 1; k <= 30; k++) {
    const last = await page.evaluate(() => Number(document.body.dataset.shown));
    await page.mouse.move(x - 10 * k, y);
    await settled(() => page.evaluate((last) => Number(document.body.dataset.shown) > last, last));
    if ((await clearance()) < -5e-4) break;
  }
  await page.mouse.up();
  await settled(async () => (await contacts()) > 0 && (await clearance()) < 0);
  await page.waitForTimeout(300);
  await picture("overlap");

  // The slice along another axis.
  await page.selectOption("#axis", "2");
  await page.waitForTimeout(1500);
  await picture("slice");

  // A file: an open box is refused with its defects, and repaired on request.
  const box = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 0 0 1\nv 1 0 1\nv 1 1 1\nv 0 1 1\nf 5 6 7 8\nf 1 2 6 5\nf 2 3 7 6\nf 3 4 8 7\nf 4 1 5 8\n";
  await page.setInputFiles("#file", { name: "open.obj", mimeType: "text/plain", buffer: Buffer.from(box) });
  await page.waitForSelector("#verdict.bad");
  assert.match(await page.textContent("#verdict"), /no well-defined inside/);
  assert.ok((await page.locator("#defects li").count()) > 0);
  await picture("refused");
  await page.check("#repair");
  await page.waitForSelector('body[data-loaded="open.obj"]');
  await page.waitForTimeout(800);
  await picture("repaired");

  assert.deepEqual(said, []);
  assert.ok(asked.every((url) => url.startsWith(address) || url.startsWith("data:")), String(asked));
  console.log("the page works");
} finally {
  await browser.close();
  server.close();
}
