// What goes on, and how it is driven. `picture.js` and `look.js` come before.

const state = { time: 0, colour: 0, forces: true };
const ranges = [null, null, null];
const run = { time: [], parts: [], force: 1, gravity: [0, 0, 0] };
runs.push(run);
const FRAME = 1000 / 60;
// What is known of the run: what frames mean, the status, the clock.
const known = { about: null, status: null, clock: null, missed: 0, frames: 0, heard: performance.now() };
const write = (id, text) => { if (by(id).textContent !== text) by(id).textContent = text; };
// The last 20 s, for the plots: times and columns.
const SHOWN = 20;
const past = { time: [], load: [], columns: new Map([["load_tension", []], ["kinetic", []], ["step", []], ["error", []]]) };

// --- The socket.
let socket = null;
const send = (command) => { if (socket?.readyState === WebSocket.OPEN) socket.send(JSON.stringify(command)); };
const connect = () => {
  socket = new WebSocket(`ws://${location.host}${location.pathname}socket`);
  socket.binaryType = "arraybuffer";
  socket.addEventListener("message", ({ data }) => {
    if (typeof data !== "string") { frame(data); return; }
    const message = JSON.parse(data);
    if (message.about) learn(message.about);
    if (message.status) { Object.assign(known, message); tell(); }
    if (message.missed) known.missed += message.missed;
    if (message.refused) refuse(message.refused);
  });
  socket.addEventListener("close", () => setTimeout(connect, 1000));
};
// What was refused stays to be read.
const refused = { text: "", until: 0 };
const refuse = (text) => {
  Object.assign(refused, { text, until: performance.now() + 6000 });
  alert();
};
const alert = () => {
  const { status } = known;
  const texts = [];
  if (socket.readyState !== WebSocket.OPEN) texts.push("No connection: `taut view` has ended, or has too many viewers.");
  if (status?.failure) texts.push(`${status.failure}. Restart the run.`);
  if (status?.fallback) texts.push(`${status.fallback}.`);
  if (performance.now() < refused.until) texts.push(refused.text);
  write("alert", texts.join(" "));
};
// A file, or why there is none.
const get = async (name, as) => {
  const answer = await fetch(name);
  if (!answer.ok) { refuse(await answer.text()); return; }
  const link = make("a", null, undefined, { href: URL.createObjectURL(await answer.blob()), download: as });
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 10000);
};
// What frames mean from here on.
const learn = (about) => {
  const before = known.about;
  known.about = about;
  const { layout } = about;
  run.gravity = about.gravity;
  [run.parts, run.time] = [[], []];
  const weight = layout.load === null ? 0 : layout.bodies[layout.load].mass * norm(about.gravity);
  run.force = weight || run.force;
  ranges.fill(null);
  const same = (key) => JSON.stringify(before?.[key]) === JSON.stringify(about[key]);
  const choices = (id, names) => by(id).replaceChildren(...names.map((name) => make("option", null, name, { value: name })));
  if (!same("solvers")) choices("solver", about.solvers);
  if (!same("schemes")) choices("scheme", about.schemes);
  if (!same("controls")) makeDrives();
};
// Of channels with the same name the first: the others are of controls.
const named = ({ channels }) => new Map(channels.map(({ name }, k) => [name, k]).reverse());
const frame = (data) => {
  const { about } = known;
  const head = new DataView(data);
  if (!about || head.getUint32(0, true) !== about.generation) return;
  const [count, time] = [head.getUint32(4, true), head.getFloat64(8, true)];
  known.heard = performance.now();
  const { layout } = about;
  const width = layout.channels.length;
  const raw = new Int32Array(data, 16, width);
  const values = new Float32Array(data.slice(16, 16 + 4 * width));
  layout.channels.forEach(({ step }, k) => { if (step !== null) values[k] = raw[k] * step; });
  const sides = new Int32Array(data, 16 + 4 * width, count * OF_CONTACT);
  const part = { layout, times: [time], values, begins: [0, count], sides, contacts: new Float32Array(data, 16 + 4 * width, count * OF_CONTACT),
    first: 0, width, names: run.parts[0]?.names ?? named(layout), held: run.parts[0]?.held };
  [run.parts, run.time] = [[part], [time]];
  // Of a layout once: it looks through all segments.
  if (part.held === undefined) part.held = holding(part);
  QUANTITIES.forEach((_, q) => {
    for (const { loads } of layout.bodies) for (const channel of loads[q]) widen(q, values[channel]);
    if (!q) for (const { tension } of layout.lines) if (tension !== null) widen(0, values[tension]);
  });
  if (time < state.time) { past.time.length = past.load.length = 0; followed = null; for (const [, y] of past.columns) y.length = 0; }
  state.time = time;
  keep(part, time);
  if (!known.frames) fit();
  known.frames += 1;
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
const pressed = new Set();
const drives = [];
const range = (parent, name) => make("input", parent, undefined, { type: "range", min: "-1", max: "1", step: "0.01", value: "0", "aria-label": name });
const makeDrives = () => {
  release();
  held.clear();
  drives.length = 0;
  by("drives").replaceChildren();
  known.about.controls.forEach(([control, followers], k) => {
    const box = make("div", by("drives"), undefined, { class: "drive" });
    const keys = PAIRS[k];
    const title = make("span", box, undefined, { class: "name" });
    title.append(control, " ");
    if (keys) title.append(make("kbd", null, keys[0]), " ", make("kbd", null, keys[1]));
    const out = make("span", box, "", { class: "value" });
    const slider = range(box, control);
    const most = make("input", box, undefined, { type: "number", min: "0", step: "any", value: "1", "aria-label": `${control}: speed of its keys` });
    const set = (value) => { slider.value = value; send({ set: { control, value } }); };
    slider.addEventListener("input", () => set(Number(slider.value)));
    slider.addEventListener("dblclick", () => set(0));
    const each = followers.length > 1 ? make("details", box) : null;
    if (each) make("summary", each, "one by one");
    const alone = each ? followers.map((drive) => {
      const one = range(make("label", each, `${drive} `), `${control}: ${drive}`);
      one.addEventListener("input", () => send({ set: { control, drive, value: Number(one.value) } }));
      return one;
    }) : [];
    const size = () => Math.abs(Number(most.value)) || 1;
    most.addEventListener("change", () => {
      for (const one of [slider, ...alone]) Object.assign(one, { min: -size(), max: size(), step: size() / 100 });
      most.blur();
    });
    const entry = { set, size, out, slider, alone };
    drives.push(entry);
    keys?.forEach((key, way) => held.set(key, { entry, way: way ? 1 : -1 }));
  });
};
const drive = (event, down) => {
  const key = event.key.toLowerCase();
  const found = held.get(key);
  if (!found || down === pressed.has(key)) return;
  // What was pressed is released whatever else is.
  if (down && (event.ctrlKey || event.metaKey || event.altKey || event.target.closest("input[type=number], select"))) return;
  if (down) pressed.add(key); else pressed.delete(key);
  const way = [...pressed].reduce((sum, k) => sum + (held.get(k)?.entry === found.entry ? held.get(k).way : 0), 0);
  found.entry.set(Math.sign(way) * found.entry.size());
};
const release = () => {
  for (const key of pressed) held.get(key)?.entry.set(0);
  pressed.clear();
};
document.addEventListener("keyup", (event) => drive(event, false));
window.addEventListener("blur", release);
const KEYS = {
  " ": () => send({ pause: !known.status?.paused }), ".": () => send("step"), "+": () => zoom(0.8), "-": () => zoom(1.25), 0: () => { fit(); redraw(); },
};
// Keys that the focused element needs itself.
const needs = (target, key) => target.closest("input[type=number], select") || (key === " " && target.closest("button, summary, input[type=checkbox]"));
document.addEventListener("keydown", (event) => {
  drive(event, true);
  if (event.ctrlKey || event.metaKey || event.altKey || needs(event.target, event.key) || !KEYS[event.key]) return;
  event.preventDefault();
  KEYS[event.key]();
});
// A click with a pointer leaves the keys to the crane.
document.addEventListener("click", (event) => { if (event.detail) event.target.closest("button, input[type=checkbox], summary")?.blur(); });

// --- What is shown.
const segmentMass = () => {
  const { bodies, cables } = known.about.layout;
  const masses = cables.flatMap((cable) => cable.bodies).map((i) => bodies[i].mass);
  return masses.length ? masses.reduce((a, b) => a + b) / masses.length : NaN;
};
const showMass = (mass) => {
  by("heavy").hidden = mass === null;
  if (mass === null || document.activeElement === by("mass")) return;
  by("mass").value = +mass.toPrecision(4);
  const ratio = mass / segmentMass();
  write("ratio", Number.isFinite(ratio) ? `${short(ratio)} times a segment` : "");
};
const showControls = (controls) => controls.forEach((values, k) => {
  const { out, slider, alone } = drives[k] ?? {};
  if (!out) return;
  const texts = new Set(values.map((value) => (value === null ? "" : value.toFixed(2))));
  out.textContent = [...texts].join(" / ");
  // Not under a finger.
  const follow = (one, value) => { if (one && value !== null && !one.matches(":active")) one.value = value; };
  follow(slider, values[0]);
  values.forEach((value, i) => follow(alone[i], value));
});
const tell = () => {
  const { status, clock } = known;
  const set = (id, value) => {
    const at = by(id);
    if (![...at.options].some((option) => option.value === value)) make("option", at, value, { value });
    if (document.activeElement !== at) at.value = value;
  };
  set("solver", status.solver);
  set("scheme", status.scheme);
  by("pause").setAttribute("aria-pressed", String(status.paused));
  by("record").setAttribute("aria-pressed", String(status.recording !== null));
  write("record", status.recording === null ? "Record" : `Recording, ${Math.round(status.recording / 1024)} KiB`);
  by("recording").hidden = status.recorded === null;
  showControls(status.controls);
  showMass(status.load);
  alert();
  const { error } = status;
  const step = past.columns.get("step").at(-1);
  const figures = by("figures");
  figures.replaceChildren();
  const add = (text, bad = false) => make("span", figures, `${figures.children.length ? "; " : ""}${text}`, bad ? { class: "bad" } : {});
  if (Number.isFinite(step)) add(`step ${short(step / 1e3)} µs`);
  add(`frame at most ${clock.busiest_ms.toFixed(2)} of ${FRAME.toFixed(1)} ms`, clock.busiest_ms > FRAME);
  add(`${clock.late} of ${clock.frames} frames late${clock.late ? `, ${clock.lost_ms.toFixed(0)} ms lost` : ""}`, clock.late > 0);
  if (known.missed) add(`${known.missed} messages missed by this page`, true);
  if (error?.lost) add("the estimate of the load's error is lost", true);
  else if (error) add(`load at most ${short(1e3 * error.total)} mm off so far (estimate${error.unseen ? `; ${error.unseen} steps not compared` : ""})`);
  if (clock.viewers > 1) add(`${clock.viewers} viewers`);
};
setInterval(() => {
  const silent = (performance.now() - known.heard) / 1000;
  if (silent > 0.5) write("figures", `no frame for ${silent.toFixed(1)} s`);
  if (socket) alert();
}, 500);
const picture = new Picture(by("picture"));
let waiting = 0;
let plotted = -Infinity;
const show = () => {
  if (!run.time.length) return;
  draw(picture, run);
  write("now", `${state.time.toFixed(2)} s`);
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
  addPlot("Estimated error of the load", "mm", series("error", 1), true);
  by("pause").addEventListener("click", () => send({ pause: !known.status?.paused }));
  by("step").addEventListener("click", () => send("step"));
  by("restart").addEventListener("click", () => send("restart"));
  by("record").addEventListener("click", () => send({ record: known.status?.recording === null }));
  by("recording").addEventListener("click", () => get("recording", "run.tape"));
  by("save").addEventListener("click", () => get("run.json", "run.json"));
  // A field that has done its work leaves the keys to the crane.
  const field = (id, command) => by(id).addEventListener("change", ({ target }) => { send(command(target.value)); target.blur(); });
  field("solver", (solver) => ({ solver }));
  field("scheme", (scheme) => ({ scheme }));
  field("mass", (mass) => ({ mass: Number(mass) }));
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
