// What goes on, and how it is driven. `picture.js` and `look.js` come before.

const state = { time: 0, colour: 0, forces: true };
const ranges = [null, null, null];
const run = { time: [], parts: [], force: 1, gravity: [0, 0, 0] };
runs.push(run);
const FRAME = 1000 / 60;
// What is known of the run: what frames mean, the status, the clock.
const known = { about: null, status: null, clock: null, missed: 0, frames: 0, open: false };
// The last 20 s, for the plots: times and columns.
const SHOWN = 20;
const past = { time: [], load: [], columns: new Map([["load_tension", []], ["kinetic", []], ["step", []], ["error", []]]) };

// --- The socket.
let socket = null;
const send = (command) => { if (socket?.readyState === WebSocket.OPEN) socket.send(JSON.stringify(command)); };
const connect = () => {
  socket = new WebSocket(`ws://${location.host}${location.pathname}socket`);
  socket.binaryType = "arraybuffer";
  socket.addEventListener("open", () => { known.open = true; tell(); });
  socket.addEventListener("message", ({ data }) => {
    if (typeof data !== "string") { frame(data); return; }
    const message = JSON.parse(data);
    if (message.about) learn(message.about);
    if (message.status) { Object.assign(known, message); tell(); }
    if (message.missed) known.missed += message.missed;
    if (message.refused) by("alert").textContent = message.refused;
  });
  socket.addEventListener("close", () => {
    known.open = false;
    by("alert").textContent = "The run has ended, or too many look on: is `taut view` still there?";
    setTimeout(connect, 1000);
  });
};
// What frames mean from here on.
const learn = (about) => {
  const first = !known.about;
  known.about = about;
  const { layout } = about;
  run.gravity = about.gravity;
  run.parts = [];
  const weight = layout.load === null ? 0 : layout.bodies[layout.load].mass * norm(about.gravity);
  run.force = weight || run.force;
  ranges.fill(null);
  const chosen = (id, names) => {
    if (by(id).options.length !== names.length) by(id).replaceChildren(...names.map((name) => make("option", null, name, { value: name })));
  };
  chosen("solver", about.solvers);
  chosen("scheme", about.schemes);
  if (first || by("drives").children.length !== about.controls.length) makeDrives();
  showMass();
};
const frame = (data) => {
  const { about } = known;
  const head = new DataView(data);
  if (!about || head.getUint32(0, true) !== about.generation) return;
  const [count, time] = [head.getUint32(4, true), head.getFloat64(8, true)];
  const { layout } = about;
  const width = layout.channels.length;
  const raw = new Int32Array(data, 16, width);
  const values = new Float32Array(data.slice(16, 16 + 4 * width));
  layout.channels.forEach(({ step }, k) => { if (step !== null) values[k] = raw[k] * step; });
  const sides = new Int32Array(data, 16 + 4 * width, count * OF_CONTACT);
  const part = { layout, times: [time], values, begins: [0, count], sides, contacts: new Float32Array(data, 16 + 4 * width, count * OF_CONTACT),
    first: 0, width, names: run.parts[0]?.names ?? new Map(layout.channels.map(({ name }, k) => [name, k])), held: run.parts[0]?.held };
  const fresh = !run.time.length;
  [run.parts, run.time] = [[part], [time]];
  // Of a layout once: it looks through all segments.
  if (part.held === undefined) part.held = holding(part);
  QUANTITIES.forEach((_, q) => {
    for (const { loads } of layout.bodies) for (const channel of loads[q]) widen(q, values[channel]);
    if (!q) for (const { tension } of layout.lines) if (tension !== null) widen(0, values[tension]);
  });
  if (time < state.time) { past.time.length = past.load.length = 0; followed = null; for (const [, y] of past.columns) y.length = 0; }
  state.time = time;
  known.frames += 1;
  keep(part, time);
  if (fresh) fit();
  follow();
  redraw();
};
// The camera goes along with the load, but stays at its height.
let followed = null;
const follow = () => {
  const load = past.load.at(-1);
  const d = followed && by("follow").checked ? add(load, followed, -1) : [0, 0, 0];
  if (d.every(Number.isFinite)) camera.target = add(camera.target, [d[0], d[1], 0]);
  followed = load;
};
const widen = (q, x) => {
  if (Number.isFinite(x)) ranges[q] = ranges[q] ? [Math.min(ranges[q][0], x), Math.max(ranges[q][1], x)] : [x, x];
};
const keep = (part, time) => {
  if (past.time.at(-1) === time) return;
  const now = { run, part, frame: 0, share: 0 };
  past.time.push(time);
  past.load.push(loadOf(now) ?? [NaN, NaN, NaN]);
  for (const [name, y] of past.columns) y.push(part.names.has(name) ? own(now, part.names.get(name)) : NaN);
  let old = 0;
  while (past.time[old] < time - SHOWN) old += 1;
  // Seldom, since it moves all of them.
  if (old > 120) { past.time.splice(0, old); past.load.splice(0, old); for (const [, y] of past.columns) y.splice(0, old); }
};

// --- Controls: sliders, and keys that drive while they are held.
const PAIRS = [["a", "d"], ["s", "w"], ["q", "e"], ["j", "l"], ["k", "i"], ["u", "o"]];
const held = new Map();
const drives = [];
const makeDrives = () => {
  drives.length = 0;
  by("drives").replaceChildren();
  known.about.controls.forEach(([name, followers], control) => {
    const box = make("div", by("drives"), undefined, { class: "drive" });
    const keys = PAIRS[control];
    const title = make("span", box, undefined, { class: "name" });
    title.append(name, " ");
    if (keys) title.append(make("kbd", null, keys[0]), " ", make("kbd", null, keys[1]));
    const out = make("output", box, "0");
    const slider = make("input", box, undefined, { type: "range", min: "-1", max: "1", step: "0.01", value: "0", "aria-label": name });
    const most = make("input", box, undefined, { type: "number", min: "0", step: "any", value: "1", "aria-label": `${name}, most` });
    const set = (value) => { slider.value = value; send({ set: { control, value } }); };
    slider.addEventListener("input", () => set(Number(slider.value)));
    slider.addEventListener("dblclick", () => set(0));
    most.addEventListener("change", () => {
      const size = Math.abs(Number(most.value)) || 1;
      Object.assign(slider, { min: -size, max: size, step: size / 100 });
    });
    if (followers.length > 1) {
      const each = make("details", box);
      make("summary", each, "one by one");
      followers.forEach((follower, drive) => {
        const label = make("label", each, `${follower} `);
        const alone = make("input", label, undefined, { type: "range", min: "-1", max: "1", step: "0.01", value: "0", "aria-label": `${name}: ${follower}` });
        alone.addEventListener("input", () => send({ set: { control, drive, value: Number(alone.value) } }));
        most.addEventListener("change", () => { Object.assign(alone, { min: slider.min, max: slider.max, step: slider.step }); });
      });
    }
    const entry = { set, most, out };
    drives.push(entry);
    keys?.forEach((key, k) => held.set(key, { entry, way: k ? 1 : -1 }));
  });
};
const pressed = new Set();
const drive = (event, down) => {
  const found = held.get(event.key.toLowerCase());
  if (!found || event.ctrlKey || event.metaKey || event.altKey || event.target.closest("input[type=number], select")) return;
  const key = event.key.toLowerCase();
  if (down === pressed.has(key)) return;
  if (down) pressed.add(key); else pressed.delete(key);
  const way = [...pressed].reduce((sum, k) => sum + (held.get(k).entry === found.entry ? held.get(k).way : 0), 0);
  found.entry.set(Math.sign(way) * (Math.abs(Number(found.entry.most.value)) || 1));
};
document.addEventListener("keyup", (event) => drive(event, false));
window.addEventListener("blur", () => {
  for (const key of pressed) held.get(key).entry.set(0);
  pressed.clear();
});
const KEYS = {
  " ": () => send({ pause: !known.status?.paused }), ".": () => send("step"), "+": () => zoom(0.8), "-": () => zoom(1.25), 0: () => { fit(); redraw(); },
};
document.addEventListener("keydown", (event) => {
  drive(event, true);
  const inControl = event.target.closest("input, select, button, a");
  if (event.ctrlKey || event.metaKey || event.altKey || inControl || !KEYS[event.key]) return;
  event.preventDefault();
  KEYS[event.key]();
});

// --- What is shown.
const segmentMass = () => {
  const { bodies, cables } = known.about.layout;
  const masses = cables.flatMap((cable) => cable.bodies).map((i) => bodies[i].mass);
  return masses.length ? masses.reduce((a, b) => a + b) / masses.length : NaN;
};
const showMass = () => {
  const { layout } = known.about;
  by("heavy").hidden = layout.load === null;
  if (layout.load === null) return;
  const { mass } = layout.bodies[layout.load];
  by("mass").value = +mass.toPrecision(4);
  const ratio = mass / segmentMass();
  by("ratio").textContent = Number.isFinite(ratio) ? `${short(ratio)} times a segment` : "";
};
const tell = () => {
  const { status, clock } = known;
  if (!status) return;
  const set = (id, value) => {
    const at = by(id);
    if (![...at.options].some((option) => option.value === value)) make("option", at, value, { value });
    if (document.activeElement !== at) at.value = value;
  };
  set("solver", status.solver);
  set("scheme", status.scheme);
  by("pause").textContent = status.paused ? "Go on" : "Pause";
  by("pause").setAttribute("aria-pressed", String(status.paused));
  by("record").textContent = status.recording === null ? "Record" : `Stop recording (${Math.round(status.recording / 1024)} KiB)`;
  by("record").setAttribute("aria-pressed", String(status.recording !== null));
  by("recording").hidden = status.recorded === null;
  status.controls.forEach((value, k) => { if (drives[k]) drives[k].out.textContent = value === null ? "" : value.toFixed(2); });
  by("alert").textContent = status.failure ? `${status.failure}. “Restart” begins anew.` : status.refused ?? "";
  const [error, step] = ["error", "step"].map((name) => past.columns.get(name).at(-1));
  const figures = by("figures");
  figures.replaceChildren();
  const add = (text, bad = false) => make("span", figures, `${figures.children.length ? "; " : ""}${text}`, bad ? { class: "bad" } : {});
  add(`a step takes ${short(step / 1e3)} µs, a frame at most ${clock.busiest_ms.toFixed(2)} of ${FRAME.toFixed(1)} ms`, clock.busiest_ms > FRAME);
  add(`${clock.late} late of ${clock.frames} frames${clock.late ? `, ${clock.lost_ms.toFixed(0)} ms lost` : ""}`, clock.late > 0);
  if (known.missed) add(`${known.missed} messages did not arrive in time`, true);
  if (Number.isFinite(error)) add(`the load is off by ${short(1e3 * error)} mm (estimate)`);
  if (clock.browsers > 1) add(`${clock.browsers} browsers`);
};
const picture = new Picture(by("picture"));
let waiting = 0;
let plotted = -Infinity;
const show = () => {
  if (!run.time.length) return;
  draw(picture, run);
  by("now").textContent = `${state.time.toFixed(2)} s`;
  legend();
  // Plots cost more than they tell at 60 a second.
  if (performance.now() - plotted < 200) return;
  plotted = performance.now();
  [span[0], span[1]] = [state.time - SHOWN, state.time];
  plots.forEach(scalePlot);
  drawPlots();
};
const redraw = () => { waiting ||= requestAnimationFrame(() => { waiting = 0; show(); }); };
// Time does not go back here.
const seek = () => {};
const begin = () => {
  readStyle();
  listen(by("picture"));
  const series = (name, scale) => [{ x: past.time, get y() { return past.columns.get(name).map((v) => v * scale); }, dash: [], colour: "ink" }];
  addPlot("Tension of the load", "N", series("load_tension", 1));
  addPlot("Kinetic energy", "J", series("kinetic", 1));
  addPlot("Time of a step", "µs", series("step", 1e-3), true);
  addPlot("Estimated error of the load", "mm", series("error", 1e3), true);
  by("pause").addEventListener("click", () => send({ pause: !known.status?.paused }));
  by("step").addEventListener("click", () => send("step"));
  by("restart").addEventListener("click", () => send("restart"));
  by("record").addEventListener("click", () => send({ record: known.status?.recording === null }));
  by("solver").addEventListener("change", (event) => send({ solver: event.target.value }));
  by("scheme").addEventListener("change", (event) => send({ scheme: event.target.value }));
  by("mass").addEventListener("change", (event) => send({ mass: Number(event.target.value) }));
  by("colour").addEventListener("change", (event) => { state.colour = Number(event.target.value); redraw(); });
  by("forces").addEventListener("change", (event) => { state.forces = event.target.checked; redraw(); });
  by("fit").addEventListener("click", () => { fit(); redraw(); });
  new ResizeObserver(redraw).observe(by("picture"));
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => { readStyle(); redraw(); });
  connect();
};
// For programs that look on.
window.view = { known, past, send, state, camera, part: () => run.parts[0] };
begin();
