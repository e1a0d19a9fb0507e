// Goes through the real page in Chromium as a person would, served and from the disk, and prints what it found as JSON.
//
//     node test/app.cjs BROWSER PICTURE FOLDER
//
// FOLDER takes what is downloaded. Anything that is not as it should be ends it with an error. tests/web.rs judges the files.

const puppeteer = require("puppeteer-core");
const assert = require("node:assert/strict");
const { execFileSync } = require("node:child_process");
const { existsSync, mkdirSync, readFileSync, statSync } = require("node:fs");
const { join } = require("node:path");
const { pathToFileURL } = require("node:url");

const [browserName, picturePath, folder] = process.argv.slice(2);
const browserPath = execFileSync("sh", ["-c", 'command -v "$1"', "sh", browserName]).toString().trim();
const root = join(__dirname, "..", "dist");
const picture = readFileSync(picturePath).toString("base64");
const PATIENCE = 120_000;
/** On which the page takes itself to be. */
const THREADS = 2;

const sleep = (ms) => new Promise((resolve) => setTimeout(resolve, ms));

/** A page that remembers what it should not have done. */
async function open(browser, allowed) {
  const page = await browser.newPage();
  const faults = [];
  page.setDefaultTimeout(PATIENCE);
  page.on("console", (message) => ["error", "warn"].includes(message.type()) && faults.push(`console: ${message.text()}`));
  page.on("pageerror", (error) => faults.push(`page: ${error.message}`));
  page.on("request", (request) => /^(data|blob):/.test(request.url()) || request.url().startsWith(allowed) || faults.push(`request: ${request.url()}`));
  await page.setViewport({ width: 1280, height: 900 });
  await (await page.createCDPSession()).send("Emulation.setHardwareConcurrencyOverride", { hardwareConcurrency: THREADS });
  return { page, faults };
}

const drafts = (page) => page.evaluate(() => performance.getEntriesByName("draft").length);
const draftAfter = (page, before) => page.waitForFunction((n) => performance.getEntriesByName("draft").length > n && document.getElementById("answer").getAttribute("aria-busy") === "false", {}, before);
const text = (page, id) => page.$eval(id, (element) => element.textContent);
const figure = (page, name) => page.$eval(`#draft-figures [data-figure="${name}"]`, (element) => element.textContent);

/** Drops a file on the page. */
async function drop(page, base64, name, type) {
  await page.evaluate(
    (base64, name, type) => {
      const bytes = Uint8Array.from(atob(base64), (letter) => letter.charCodeAt(0));
      const data = new DataTransfer();
      data.items.add(new File([bytes], name, { type }));
      document.getElementById("drop").dispatchEvent(new DragEvent("drop", { dataTransfer: data, bubbles: true, cancelable: true }));
    },
    base64,
    name,
    type,
  );
}

/** Takes hold in the middle of an element and pulls it. */
async function pull(page, selector, from, to) {
  const element = await page.$(selector);
  await element.scrollIntoView();
  const box = await element.boundingBox();
  const at = ([x, y]) => [box.x + x * box.width, box.y + y * box.height];
  await page.mouse.move(...at(from));
  await page.mouse.down();
  await page.mouse.move(...at([(from[0] + to[0]) / 2, (from[1] + to[1]) / 2]), { steps: 4 });
  await page.mouse.move(...at(to), { steps: 4 });
  await page.mouse.up();
}

async function slide(page, id, value) {
  await page.$eval(id, (input, value) => {
    input.value = String(value);
    input.dispatchEvent(new Event("input", { bubbles: true }));
  }, value);
}

async function choose(page, id, value) {
  await page.select(id, String(value));
}

/** Waits until a file is there as a whole. */
async function downloaded(path) {
  for (let k = 0; k < PATIENCE / 100; k++) {
    if (existsSync(path) && !existsSync(`${path}.crdownload`) && statSync(path).size > 0) {
      const size = statSync(path).size;
      await sleep(150);
      if (statSync(path).size === size) return size;
    }
    await sleep(100);
  }
  throw new Error(`${path} was not downloaded`);
}

async function downloadInto(page, path) {
  mkdirSync(path, { recursive: true });
  const client = await page.createCDPSession();
  await client.send("Browser.setDownloadBehavior", { behavior: "allow", downloadPath: path });
}

async function make(page, nodes) {
  await choose(page, "#make-nodes", nodes);
  await page.click("#make");
}

const settled = (page) => page.waitForFunction(() => document.getElementById("make-cancel").hidden);

async function makeAndDownload(page, nodes, path) {
  await downloadInto(page, path);
  const begin = Date.now();
  await make(page, nodes);
  await page.waitForSelector("#verdict", { timeout: PATIENCE });
  await settled(page);
  const seconds = (Date.now() - begin) / 1000;
  assert.equal(await page.$eval("#make-fault", (element) => element.hidden), true, await text(page, "#make-fault"));
  await page.click('[data-file="stl"]');
  await downloaded(join(path, "camera.stl"));
  await page.click('[data-file="side"]');
  await downloaded(join(path, "camera.toml"));
  const value = (name) => page.$eval(`[data-verified="${name}"]`, (element) => Number(element.dataset.value));
  return { seconds, rel_rms: await value("rel_rms"), ssim: await value("ssim") };
}

/** Asks whether the block is ready; says what `glasswarp ready` should say too. */
async function ready(page, path) {
  await page.$eval("#shop-polish", (field) => (field.value = "0.1mm"));
  // What is no cutter is told, and nothing is lost.
  await page.$eval("#shop-cutter", (field) => (field.value = "spoon:d6mm"));
  await page.click("#ready");
  await page.waitForFunction(() => /cutter/.test(document.getElementById("ready-fault").textContent));
  await page.$eval("#shop-cutter", (field) => (field.value = "ball:d6mm"));
  await page.click("#ready");
  await page.waitForSelector("#ready-verdict");
  assert.equal(await page.$eval("#ready-fault", (element) => element.hidden), true);
  await page.waitForFunction(() => document.getElementById("ready-cancel").hidden);
  await page.click('[data-file="sheet"]');
  await downloaded(join(path, "camera.ready.html"));
  await page.click('[data-file="report"]');
  await downloaded(join(path, "camera.report.html"));
  const rows = (id) => page.$$eval(`${id} tr`, (rows) => rows.map((row) => [...row.children].map((cell) => cell.textContent)));
  return { answer: await page.$eval("#ready-verdict", (element) => element.dataset.answer), concerns: await rows("#ready-concerns"), checks: await rows("#ready-checks"), steps: (await page.$$("#ready-steps figure")).length };
}

/** The pages that were made show what they say without an error, as files do. */
async function pages(browser, path) {
  for (const name of ["camera.report.html", "camera.ready.html"]) {
    const url = pathToFileURL(join(path, name)).href;
    const { page, faults } = await open(browser, url);
    await page.goto(url);
    assert.match(await page.evaluate(() => document.body.textContent), /camera[^]*Will it work\?/);
    assert.deepEqual(faults, [], name);
    await page.close();
  }
}

/** A file for an input of the page. */
async function give(page, input, name, text) {
  await page.$eval(input, (input, name, text) => {
    const data = new DataTransfer();
    data.items.add(new File([text], name));
    input.files = data.files;
    input.dispatchEvent(new Event("change", { bubbles: true }));
  }, name, text);
}

/** Pictures that the browser draws, or that are too large, and files that settings name. */
async function otherFiles(page) {
  let before = await drafts(page);
  const drawing = '<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 30 20" width="30" height="20"><circle cx="15" cy="10" r="7" fill="white" stroke="black"/></svg>';
  await drop(page, Buffer.from(drawing).toString("base64"), "ring.svg", "image/svg+xml");
  await page.waitForFunction(() => /ring\.png, 2048 × 1365/.test(document.querySelector("#picture-title").parentElement.textContent));
  await draftAfter(page, before);
  before = await drafts(page);
  const large = await page.evaluate(() => {
    const canvas = Object.assign(document.createElement("canvas"), { width: 4200, height: 3000 });
    const context = canvas.getContext("2d");
    for (let k = 0; k < 42; k++) context.fillStyle = `rgb(${6 * k} ${6 * k} ${6 * k})`, context.fillRect(100 * k, 0, 100, 3000);
    return canvas.toDataURL("image/png").split(",")[1];
  });
  await drop(page, large, "ramp.png", "image/png");
  await page.waitForSelector("#picture-offer:not([hidden]) #picture-reduce");
  await page.click("#picture-reduce");
  await page.waitForFunction(() => /ramp\.2048px\.png, 2048 × 1463/.test(document.querySelector("#picture-title").parentElement.textContent));
  await draftAfter(page, before);
  before = await drafts(page);
  await page.evaluate(() => { document.getElementById("more-settings").open = true; });
  await give(page, "#other-files", "lamp.ies", "IESNA:LM-63-2002\nTILT=NONE\n1 100 1 4 1 1 2 0 0 0\n1 1 1\n0 10 20 40\n0\n100 90 60 5\n");
  await page.waitForFunction(() => /lamp\.ies/.test(document.getElementById("other-file-list").textContent));
  await page.select("#setting-light", "point");
  await page.waitForFunction(() => /light=point/.test(location.hash));
  await page.type("#setting-emission", "lamp.ies\n");
  await page.waitForFunction(() => /emission=lamp\.ies/.test(location.hash));
  await page.waitForFunction(() => /IES/.test(document.getElementById("moving-note").textContent));
  assert.equal(await page.$eval("#draft-fault", (element) => element.hidden), true, await text(page, "#draft-fault"));
  await page.evaluate(() => { location.hash = ""; });
  await page.waitForFunction(() => document.getElementById("moving-note").textContent === "");
}

async function cancelled(page) {
  await make(page, 1025);
  await page.waitForFunction(() => /\d+\/\d+/.test(document.getElementById("make-status").textContent));
  const begin = Date.now();
  await page.click("#make-cancel");
  await page.waitForFunction(() => document.getElementById("make-status").textContent === "Cancelled.");
  await settled(page);
  return Date.now() - begin;
}

/** What the moving light differs from the verifier by, in five poses of everything that can be moved. */
async function poses(page) {
  const errors = [];
  for (const pose of [{}, { distance: 275 }, { wallTilt: 12, lightX: 1.5 }, { blockTilt: 4, lightY: -3 }, { index: 1.51, distance: 230, wallTilt: -8, wavelength: 450 }]) {
    await page.click("#pose-reset");
    for (const [name, value] of Object.entries(pose)) await slide(page, `#pose-${name}`, value);
    const before = await page.$eval("#moving-note", (note) => (note.textContent = "") || note.textContent);
    assert.equal(before, "");
    await page.click("#pose-check");
    await page.waitForFunction(() => document.getElementById("moving-note").textContent !== "");
    const said = await text(page, "#moving-note");
    const error = Number(/([\d.]+) %/.exec(said)?.[1]) / 100;
    assert.ok(error <= 0.03, `${JSON.stringify(pose)}: ${said}`);
    errors.push(error);
    await sleep(300);
  }
  const rate = Number(/\d+/.exec(await text(page, "#moving-rate"))?.[0]);
  return { errors, rate };
}

async function hosted(browser) {
  const { serve } = await import(pathToFileURL(join(__dirname, "server.mjs")).href);
  let server = await serve(join(root, "hosted"));
  const { page, faults } = await open(browser, server.url);
  const found = {};
  await page.goto(server.url);
  await page.waitForSelector("#drop");
  assert.ok(await page.evaluate(() => crossOriginIsolated));

  // What is no picture changes nothing, and says so.
  await drop(page, Buffer.from("%PDF-1.7\n").toString("base64"), "page.pdf", "application/pdf");
  await page.waitForFunction(() => /PDF/.test(document.querySelector("#picture-title").parentElement.textContent));
  const dot = await page.evaluate(() => Object.assign(document.createElement("canvas"), { width: 1, height: 1 }).toDataURL("image/png").split(",")[1]);
  await drop(page, dot, "dot.png", "image/png");
  await page.waitForFunction(() => /1 x 1/.test(document.querySelector("#picture-title").parentElement.textContent));

  let begin = Date.now();
  await drop(page, picture, "camera.png", "image/png");
  await draftAfter(page, 0);
  found.first_draft_ms = Date.now() - begin;
  assert.equal(page.workers().length, 1 + THREADS, "pictures on one thread, drafts on all");

  // Crop.
  let before = await drafts(page);
  await page.waitForFunction(() => document.querySelector(".original").width > 300);
  await pull(page, ".original", [0.1, 0.05], [0.9, 0.85]);
  await page.waitForFunction(() => /crop=/.test(location.hash));
  await draftAfter(page, before);

  // Take the wall and pull it.
  before = await drafts(page);
  await pull(page, "#handle-wall", [0.5, 0.7], [1.6, 0.7]);
  const distance = await page.evaluate(() => Number(/distance=(\d+)mm/.exec(location.hash)?.[1]));
  assert.ok(distance > 255, `the wall stands at ${distance} mm`);
  await draftAfter(page, before);
  assert.match(await text(page, "#draft-status"), /129/);
  assert.ok(Number.isFinite(Number.parseFloat(await figure(page, "relRms"))));

  // Undo and redo.
  await page.click("#undo");
  assert.ok(!(await page.evaluate(() => location.hash)).includes("distance"));
  await page.click("#redo");
  await page.waitForFunction((mm) => location.hash.includes(`distance=${mm}mm`), {}, distance);

  // A slider moved, from the change to the answer.
  before = await drafts(page);
  await sleep(1500);
  before = await drafts(page);
  begin = Date.now();
  await slide(page, "#edit-offset", 0.15);
  await draftAfter(page, before);
  found.slider_draft_ms = Date.now() - begin;

  // By number and by keyboard; what is wrong is told at its field.
  await page.click("#setting-size", { count: 3 });
  await page.type("#setting-size", "12 furlongs\n");
  await page.waitForFunction(() => /furlongs/.test(document.getElementById("setting-size-fault").textContent));
  before = await drafts(page);
  await page.$eval("#setting-size", (field) => (field.value = ""));
  await page.click("#setting-size");
  await page.type("#setting-size", "110mm\n");
  await page.waitForFunction(() => location.hash.includes("size=110mm"));
  await draftAfter(page, before);
  before = await drafts(page);
  await page.$eval("#handle-size", (handle) => handle.focus());
  await page.keyboard.press("ArrowLeft");
  await page.waitForFunction(() => location.hash.includes("size=105mm"));
  await draftAfter(page, before);

  found.poses = await poses(page);
  found.block = await makeAndDownload(page, 257, join(folder, "hosted"));
  await page.click('[data-file="zip"]');
  found.zip_bytes = await downloaded(join(folder, "hosted", "camera.zip"));
  found.ready = await ready(page, join(folder, "hosted"));
  await pages(browser, join(folder, "hosted"));
  found.cancel_ms = await cancelled(page);

  // Nothing is lost but the run.
  const hash = await page.evaluate(() => location.hash);
  await page.evaluate(() => navigator.serviceWorker.ready.then(() => undefined));
  await page.reload();
  await draftAfter(page, 0);
  assert.equal(await page.evaluate(() => location.hash), hash);
  await page.waitForSelector("#designs canvas");

  // Without a network.
  await page.waitForFunction(() => navigator.serviceWorker.controller !== null);
  await server.close();
  await page.reload();
  await draftAfter(page, 0);
  await otherFiles(page);
  const words = () => page.$$eval("#bench-title ~ * .hint, #bench-title ~ * .setting label, #bench-title ~ * .setting option", (all) => all.map((one) => one.textContent).filter((text) => / .* /.test(text)));
  const english = new Set(await words());
  await page.click("#language");
  await page.waitForFunction(() => document.documentElement.lang === "de" && document.getElementById("undo")?.textContent === "Rückgängig");
  // Names of materials are what suppliers call them.
  const untranslated = (await words()).filter((text) => english.has(text) && !/, n = /.test(text));
  assert.deepEqual(untranslated, []);
  assert.deepEqual(faults, []);
  await page.close();
  return found;
}

/** A server that knows nothing of isolation: the service worker says it, from the second time on. */
async function plainlyServed(browser) {
  const { serve } = await import(pathToFileURL(join(__dirname, "server.mjs")).href);
  const server = await serve(join(root, "hosted"), 0, false);
  const { page, faults } = await open(browser, server.url);
  await page.goto(server.url);
  await page.waitForSelector("#drop");
  assert.equal(await page.evaluate(() => crossOriginIsolated), false);
  await drop(page, picture, "camera.png", "image/png");
  await draftAfter(page, 0);
  assert.equal(page.workers().length, 2, "pictures and drafts");
  await page.waitForFunction(() => navigator.serviceWorker.controller !== null);
  await page.reload();
  await page.waitForSelector("#drop");
  assert.ok(await page.evaluate(() => crossOriginIsolated));
  // The picture was kept.
  await draftAfter(page, 0);
  assert.equal(page.workers().length, 1 + THREADS);
  assert.deepEqual(faults, []);
  await page.close();
  await server.close();
}

async function fromDisk(browser) {
  const url = pathToFileURL(join(root, "glasswarp.html")).href;
  const { page, faults } = await open(browser, url);
  await page.goto(url);
  await page.waitForSelector("#drop");
  await drop(page, picture, "camera.png", "image/png");
  await draftAfter(page, 0);
  const found = { block: await makeAndDownload(page, 257, join(folder, "disk")), cancel_ms: await cancelled(page) };
  // The worker that was ended has a successor.
  const before = await drafts(page);
  await slide(page, "#edit-offset", 0.2);
  await draftAfter(page, before);
  assert.deepEqual(faults, []);
  await page.close();
  return found;
}

async function main() {
  const browser = await puppeteer.launch({
    executablePath: browserPath,
    protocolTimeout: PATIENCE,
    args: [...(process.getuid?.() === 0 ? ["--no-sandbox"] : []), "--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--ignore-gpu-blocklist", "--lang=en"],
  });
  try {
    const found = { hosted: await hosted(browser), disk: await fromDisk(browser) };
    await plainlyServed(browser);
    console.log(JSON.stringify(found));
  } finally {
    await browser.close();
  }
}

main().catch((error) => {
  console.error(error);
  process.exit(1);
});
