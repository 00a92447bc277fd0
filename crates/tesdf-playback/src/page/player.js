// The controls: time, mouse, touch, keys, and the lists.

const SPEEDS = [0.001, 0.002, 0.005, 0.01, 0.02, 0.05, 0.1, 0.2, 0.5, 1, 2, 5, 10];
// A run that begins to play takes at least this long, s, if one of the speeds makes it.
const LEAST_SECONDS = 5;
// A press that ends within this many pixels of its begin is a click.
const CLICK = 4;

const element = (id) => document.getElementById(id);

class Player {
  constructor(run, canvas) {
    Object.assign(this, { run, canvas, camera: new Camera(), scene: new Scene(canvas, run) });
    const { times } = run;
    Object.assign(this, { time: times[0], playing: false, asked: false, last: 0 });
    this.bodyLabels = [];
    this.corners = [];
    for (let k = 0; k < 8; k++) {
      this.corners.push([0, 1, 2].map((axis) => run.bounds[(k >> axis) & 1][axis]));
    }
    if (run.is_live) this.follow();
    this.fillLists();
    this.listen();
    this.fit();
    this.show();
  }

  // A run that is still made: at its end, the time goes on with it.
  follow() {
    const { run } = this;
    element("live").hidden = false;
    let end = run.times.at(-1);
    follow(run, (state) => {
      element("live").textContent = state;
      element("slider").max = run.times.length - 1;
      if (!this.playing && this.time >= end) this.time = run.times.at(-1);
      end = run.times.at(-1);
      this.show();
    });
  }

  fit() {
    const { clientWidth, clientHeight } = this.canvas;
    this.leaveRoom();
    this.camera.fit(this.corners, clientWidth / Math.max(clientHeight, 1));
    this.show();
  }

  // Keeps the target in the middle of what the controls leave free, unless they cover too much.
  leaveRoom() {
    const { clientWidth, clientHeight } = this.canvas;
    const left = element("panel").getBoundingClientRect().right / clientWidth;
    const bottom = 1 - element("player").getBoundingClientRect().top / clientHeight;
    this.camera.covered = [left, bottom].map((share) => (share < 0.4 ? share : 0));
    this.show();
  }

  // Asks for a new picture.
  show() {
    if (this.asked) return;
    this.asked = true;
    requestAnimationFrame((now) => this.picture(now));
  }

  get seconds() {
    return this.run.times.at(-1) - this.run.times[0];
  }

  // The frame at the current time, and the share of the way to the next one.
  get moment() {
    const { times } = this.run;
    let [low, high] = [0, times.length - 1];
    while (low < high) {
      const middle = (low + high + 1) >> 1;
      if (times[middle] <= this.time) low = middle;
      else high = middle - 1;
    }
    const next = times[low + 1];
    const share = next === undefined ? 0 : (this.time - times[low]) / (next - times[low]);
    return { frame: low, share: Math.min(Math.max(share, 0), 1) };
  }

  picture(now) {
    this.asked = false;
    if (this.playing) {
      this.advance(Math.min(now - this.last, 200) / 1000);
      this.last = now;
    }
    const { frame, share } = this.moment;
    this.scene.draw(this.camera, frame, share);
    this.write(frame, share);
    if (this.playing) this.show();
  }

  advance(seconds) {
    const { times } = this.run;
    this.time += seconds * SPEEDS[element("speed").selectedIndex];
    if (this.time < times.at(-1)) return;
    if (element("loop").checked && !this.run.is_live && this.seconds > 0) {
      this.time = times[0] + ((this.time - times[0]) % this.seconds);
    } else {
      this.time = times.at(-1);
      this.play(false);
    }
  }

  play(playing) {
    if (playing && this.time >= this.run.times.at(-1)) this.time = this.run.times[0];
    this.playing = playing;
    this.last = performance.now();
    document.body.classList.toggle("playing", playing);
    element("play").setAttribute("aria-label", playing ? "Pause" : "Play");
    this.show();
  }

  // Goes to a frame and stops there.
  go(frame) {
    const { times } = this.run;
    this.play(false);
    this.time = times[Math.min(Math.max(frame, 0), times.length - 1)];
    this.show();
  }

  step(frames) {
    const { frame, share } = this.moment;
    this.go(frames < 0 && share > 0 ? frame + frames + 1 : frame + frames);
  }

  write(frame, share) {
    const { times, steps, contacts } = this.run;
    element("slider").value = frame + share;
    const digits = Math.max(0, Math.min(6, 3 - Math.floor(Math.log10(this.seconds || 1))));
    element("time").textContent = `${this.time.toFixed(digits)} s of ${times.at(-1).toFixed(digits)} s`;
    const nearest = share < 0.5 ? frame : frame + 1;
    element("facts").textContent = `frame ${nearest + 1} of ${times.length} · step ${steps[nearest]}`;
    if (this.run.forces) this.writeForces(nearest);
    if (!contacts) return;
    const [found, deepest] = [contacts.found[nearest], contacts.deepest[nearest]];
    const shown = contacts.starts[nearest + 1] - contacts.starts[nearest];
    const parts = [found === 1 ? "1 contact" : `${found} contacts`];
    if (shown < found) parts.push(`${shown} drawn`);
    if (found > 0) parts.push(deepest < 0 ? `deepest ${lengthText(-deepest)}` : `nearest ${lengthText(deepest)} apart`);
    element("contact-facts").textContent = parts.join(", ");
  }

  writeForces(frame) {
    const { frames, greatest } = this.run.forces;
    const { step, found, vectors } = frames[frame];
    const shown = vectors.length / 3;
    const parts = [found === 1 ? "1 force" : `${found} forces`];
    if (step !== null) parts[0] += ` in step ${step}`;
    if (shown < found) parts.push(`${shown} drawn`);
    // The greatest one of a frame comes first.
    if (shown > 0) parts.push(`greatest ${forceText(Math.hypot(...vectors.slice(0, 3)))}`);
    element("force-facts").textContent = `${parts.join(", ")}; the longest arrow is ${forceText(greatest)}`;
  }

  fillLists() {
    const { bodies, contacts, times, warnings } = this.run;
    element("about-warnings").hidden = warnings.length === 0;
    element("about-warnings").firstElementChild.textContent = `Warnings (${warnings.length})`;
    element("warnings").append(...warnings.map((text) => Object.assign(document.createElement("li"), { textContent: text })));
    const lists = bodies.map((body, number) => {
      const [item, label, box, colour] = ["li", "label", "input", "i"].map((name) => document.createElement(name));
      Object.assign(box, { type: "checkbox", checked: true });
      const srgb = body.colour.map((c) => Math.round(255 * (c <= 0.0031308 ? 12.92 * c : 1.055 * c ** (1 / 2.4) - 0.055)));
      colour.style.background = `rgb(${srgb})`;
      label.append(box, colour, body.name);
      label.addEventListener("pointerenter", () => this.highlight(number));
      label.addEventListener("pointerleave", () => this.highlight(-1));
      box.addEventListener("change", () => {
        if (box.checked) this.scene.hidden.delete(number);
        else this.scene.hidden.add(number);
        this.show();
      });
      item.append(label);
      this.bodyLabels.push(label);
      return item;
    });
    element("bodies").append(...lists);
    element("about-bodies").firstElementChild.textContent = `Bodies (${bodies.length})`;
    element("slider").max = times.length - 1;
    const names = SPEEDS.map((speed) => `${speed} ×`);
    element("speed").append(...names.map((name) => new Option(name)));
    // The duration of a run that is still made is not known.
    const slow = this.run.is_live ? SPEEDS.length : SPEEDS.findLastIndex((speed) => this.seconds / speed >= LEAST_SECONDS);
    element("speed").selectedIndex = Math.min(Math.max(slow, 0), SPEEDS.indexOf(1));
    element("forces").hidden = !this.run.forces;
    if (!contacts) return;
    element("contacts").hidden = false;
    // Contacts and forces are at the same places.
    element("show-contacts").checked = this.scene.showContacts;
    // The colours of the arrows, from the deepest overlap to the widest gap.
    const { most_deep: deep, most_apart: apart } = contacts;
    const marks = [];
    if (lengthText(deep) !== "0") marks.push(["#aa0084", `${lengthText(deep)} deep`], ["#f3706a", ""]);
    marks.push(["#fddc59", "touch"]);
    if (lengthText(apart) !== "0") marks.push(["#59ccd4", `${lengthText(apart)} apart`]);
    const colours = marks.map(([colour]) => colour);
    element("scale").style.background = `linear-gradient(90deg, ${[...colours, colours.at(-1)].slice(0, Math.max(colours.length, 2))})`;
    const ticks = marks.map(([, text]) => text);
    element("ticks").append(...ticks.map((text) => Object.assign(document.createElement("span"), { textContent: text })));
  }

  highlight(number) {
    if (this.scene.highlighted === number) return;
    this.bodyLabels[this.scene.highlighted]?.classList.remove("under");
    this.bodyLabels[number]?.classList.add("under");
    this.scene.highlighted = number;
    this.show();
  }

  listen() {
    element("play").addEventListener("click", () => this.play(!this.playing));
    element("back").addEventListener("click", () => this.step(-1));
    element("forward").addEventListener("click", () => this.step(1));
    element("slider").addEventListener("input", (event) => this.go(Math.round(event.target.value)));
    element("show-contacts").addEventListener("change", (event) => {
      this.scene.showContacts = event.target.checked;
      this.show();
    });
    element("show-forces").addEventListener("change", (event) => {
      this.scene.showForces = event.target.checked;
      this.show();
    });
    addEventListener("resize", () => this.leaveRoom());
    addEventListener("keydown", (event) => this.key(event));
    this.canvas.addEventListener("webglcontextlost", (event) => event.preventDefault());
    this.canvas.addEventListener("webglcontextrestored", () => location.reload());
    this.listenToPointers();
  }

  key(event) {
    if (event.ctrlKey || event.metaKey || event.altKey || event.target.tagName === "SELECT") return;
    const box = (id) => () => element(id).click();
    const speed = (more) => () => {
      const select = element("speed");
      select.selectedIndex = Math.min(Math.max(select.selectedIndex + more, 0), SPEEDS.length - 1);
    };
    const actions = {
      " ": () => this.play(!this.playing),
      ArrowLeft: () => this.step(event.shiftKey ? -10 : -1),
      ArrowRight: () => this.step(event.shiftKey ? 10 : 1),
      ArrowUp: speed(1),
      ArrowDown: speed(-1),
      Home: () => this.go(0),
      End: () => this.go(this.run.times.length - 1),
      c: box("show-contacts"),
      f: () => this.fit(),
      l: box("loop"),
      p: box("show-forces"),
    };
    const action = actions[event.key] ?? actions[event.key.toLowerCase()];
    if (!action) return;
    // The focused button or slider does not do it a second time.
    event.preventDefault();
    action();
  }

  listenToPointers() {
    const { canvas, camera } = this;
    const pointers = new Map();
    let moved = 0;
    const changed = () => {
      this.name(null);
      this.show();
    };
    const drag = (event) => {
      const before = pointers.get(event.pointerId);
      const [dx, dy] = [event.clientX - before.x, event.clientY - before.y];
      const height = canvas.clientHeight;
      moved += Math.abs(dx) + Math.abs(dy);
      if (pointers.size >= 2) {
        const other = [...pointers].find(([id]) => id !== event.pointerId)[1];
        const span = (p) => Math.max(Math.hypot(p.x - other.x, p.y - other.y), 1);
        camera.zoom(span(before) / span({ x: event.clientX, y: event.clientY }), this.run.diagonal);
        camera.move(dx / 2 / height, -dy / 2 / height);
      } else if (before.moves || event.shiftKey) {
        camera.move(dx / height, -dy / height);
      } else {
        camera.turn((Math.PI * dx) / height, (Math.PI * dy) / height);
      }
      Object.assign(before, { x: event.clientX, y: event.clientY });
      changed();
    };
    canvas.addEventListener("pointerdown", (event) => {
      canvas.setPointerCapture(event.pointerId);
      canvas.focus();
      canvas.classList.add("dragged");
      moved = pointers.size > 0 ? moved : 0;
      pointers.set(event.pointerId, { x: event.clientX, y: event.clientY, moves: event.button > 0 });
    });
    canvas.addEventListener("pointermove", (event) => {
      if (pointers.has(event.pointerId)) drag(event);
      else if (event.pointerType === "mouse" && !this.playing) this.look(event);
    });
    const end = (event) => {
      pointers.delete(event.pointerId);
      canvas.classList.toggle("dragged", pointers.size > 0);
      // A touch has no hover: a tap names the body.
      if (event.type === "pointerup" && event.pointerType !== "mouse" && moved < CLICK) this.look(event);
    };
    canvas.addEventListener("pointerup", end);
    canvas.addEventListener("pointercancel", end);
    canvas.addEventListener("pointerleave", () => this.name(null));
    canvas.addEventListener("contextmenu", (event) => event.preventDefault());
    canvas.addEventListener("wheel", (event) => {
      event.preventDefault();
      const lines = event.deltaMode === 1 ? 16 : 1;
      camera.zoom(Math.exp(Math.min(Math.max(event.deltaY * lines, -240), 240) / 600), this.run.diagonal);
      changed();
    }, { passive: false });
    canvas.addEventListener("dblclick", (event) => {
      const found = this.scene.look(camera, event.clientX, event.clientY);
      if (found) camera.target = sum(camera.target, found.point);
      changed();
    });
  }

  // Names the body under the mouse, at most once for each picture.
  look(event) {
    if (this.looking) return;
    this.looking = true;
    requestAnimationFrame(() => {
      this.looking = false;
      const found = this.scene.look(this.camera, event.clientX, event.clientY);
      this.name(found, event.clientX, event.clientY);
    });
  }

  name(found, x, y) {
    const label = element("name");
    label.hidden = !found;
    this.highlight(found ? found.body : -1);
    if (!found) return;
    label.textContent = this.run.bodies[found.body].name;
    label.style.left = `${Math.min(x + 14, innerWidth - label.offsetWidth - 8)}px`;
    label.style.top = `${Math.max(y - 30, 8)}px`;
  }
}

readRun()
  .then((run) => {
    // With the first picture, the page says that it is ready.
    new Player(run, element("view"));
    requestAnimationFrame(() => requestAnimationFrame(() => document.body.classList.add("ready")));
  })
  .catch((error) => {
    element("failure").hidden = false;
    element("failure").textContent = `The run cannot be shown: ${error.message}.`;
    throw error;
  });
