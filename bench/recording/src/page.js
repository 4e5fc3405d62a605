// A recording, or two, to play and scrub through. `picture.js` and `look.js` come before.

const makePlots = () => {
  const both = (name, scale = 1) => runs.map((run, k) => ({
    x: run.time, y: column(run, name).map((v) => v * scale), dash: [], colour: k ? "second" : "ink", label: runs.length > 1 ? run.title : "",
  }));
  addPlot("Tension of the load", "N", both("load_tension"));
  const energies = [["kinetic", [], "ink"], ["gravity", [6, 3], "force"], ["elastic", [2, 2], "load"]];
  addPlot("Energy; of gravity since the start", "J", runs.flatMap((run, r) => energies.map(([name, dash, colour]) => {
    const y = column(run, name);
    const zero = name === "gravity" ? y[0] : 0;
    return { x: run.time, y: y.map((v) => v - zero), dash, colour: r ? "second" : colour, label: r ? "" : name };
  })));
  addPlot("Largest gap", "m", both("max_gap"), true);
  addPlot("Time of a step", "µs", both("step", 1e-3), true);
  addPlot("Estimated error of the load", "mm", both("error"), true);
  if (runs.length > 1) {
    const [run] = runs;
    const y = Float32Array.from(run.time, distance);
    addPlot("Distance of the loads", "mm", [{ x: run.time, y, dash: [], colour: "ink", label: "" }]);
  }
};
// Of the loads of two runs, in mm, while both go on.
const distance = (time) => {
  const there = runs.map((run) => (run.time.length && time <= run.time.at(-1) + 1e-9 ? loadOf(at(run, time)) : null));
  return there.every(Boolean) ? 1e3 * norm(add(there[0], there[1], -1)) : NaN;
};

// --- What is shown, and how it is changed.
const state = { time: 0, playing: false, speed: 1, colour: 0, forces: true };
// Least and most of each quantity, where there is any.
const ranges = [null, null, null];
const pictures = [];
const show = () => {
  runs.forEach((run, k) => draw(pictures[k], run));
  by("time").value = state.time;
  by("now").textContent = `${state.time.toFixed(3)} s`;
  const share = (state.time - span[0]) / (span[1] - span[0] || 1);
  for (const { canvas, cursor } of plots) cursor.style.left = `${canvas.offsetLeft + share * canvas.clientWidth}px`;
  const texts = runs.filter((run) => run.time.length).map((run) => {
    const now = at(run, state.time);
    const [load, tension] = [loadOf(now), own(now, now.part.names.get("load_tension"))];
    const pull = Number.isFinite(tension) ? `, tension ${short(tension)} N` : "";
    return `load at (${load?.map((x) => x.toFixed(3)).join(", ")}) m${pull}`;
  });
  if (runs.length > 1) texts.push(`loads apart by ${short(distance(state.time))} mm`);
  by("told").textContent = texts.join("; ");
};
let waiting = 0;
const redraw = () => { waiting ||= requestAnimationFrame(() => { waiting = 0; show(); }); };
const seek = (time) => {
  state.time = Math.max(span[0], Math.min(span[1], time));
  redraw();
};
const frames = { count: 0 };
let last = 0;
const tick = (now) => {
  if (!state.playing) return;
  state.time += ((now - last) / 1000) * state.speed;
  last = now;
  if (state.time >= span[1]) play(false);
  state.time = Math.min(state.time, span[1]);
  show();
  frames.count += 1;
  requestAnimationFrame(tick);
};
const play = (on) => {
  const goes = state.playing;
  state.playing = on;
  by("play").textContent = on ? "Pause" : "Play";
  by("play").setAttribute("aria-pressed", String(on));
  if (!on || goes) return;
  if (state.time >= span[1]) state.time = span[0];
  last = performance.now();
  requestAnimationFrame(tick);
};
const step = (by) => {
  const run = runs.reduce((a, b) => (b.time.length > a.time.length ? b : a));
  const { part, frame } = at(run, state.time);
  const next = Math.max(0, Math.min(run.time.length - 1, part.first + frame + by));
  play(false);
  seek(run.time[next]);
};
const KEYS = {
  " ": () => play(!state.playing), ArrowLeft: () => step(-1), ArrowRight: () => step(1), Home: () => seek(span[0]),
  End: () => seek(span[1]), "+": () => zoom(0.8), "-": () => zoom(1.25), 0: () => { fit(); redraw(); },
};
document.addEventListener("keydown", (event) => {
  const inControl = event.target.closest("input, select") && event.key !== " ";
  const pressed = event.target.closest("button, select") && event.key === " ";
  if (event.ctrlKey || event.metaKey || event.altKey || inControl || pressed || !KEYS[event.key]) return;
  event.preventDefault();
  KEYS[event.key]();
});

const measure = () => {
  for (const run of runs) {
    // What an arrow of usual length stands for: the weight of the load, or else the largest tension.
    run.force = 0;
    for (const part of run.parts) {
      const { bodies, lines, load: i } = part.layout;
      if (i !== null) run.force = Math.max(run.force, bodies[i].mass * norm(run.gravity));
      QUANTITIES.forEach((_, q) => {
        const channels = [...bodies.flatMap((b) => b.loads[q]), ...(q ? [] : lines.map((l) => l.tension).filter((c) => c !== null))];
        for (const channel of new Set(channels)) for (let k = channel; k < part.values.length; k += part.width) {
          const x = part.values[k];
          if (!Number.isFinite(x)) continue;
          ranges[q] = ranges[q] ? [Math.min(ranges[q][0], x), Math.max(ranges[q][1], x)] : [x, x];
        }
      });
    }
    for (const v of run.force > 0 ? [] : column(run, "load_tension")) if (v > run.force) run.force = v;
    run.force ||= 1;
    if (run.time.length) [span[0], span[1]] = [Math.min(span[0], run.time[0]), Math.max(span[1], run.time.at(-1))];
  }
  if (span[0] > span[1]) [span[0], span[1]] = [0, 0];
};
const begin = async () => {
  readStyle();
  for (const run of runs) await load(run);
  measure();
  for (const run of runs) {
    const view = make("div", by("views"), undefined, { class: "view" });
    make("h2", view, `${run.title}: ${run.scene}`);
    make("p", view, `${run.solver}, steps of ${short(1e3 * run.dt)} ms${run.thinned > 1 ? `; each ${run.thinned}th frame` : ""}`, { class: "quiet" });
    const canvas = make("canvas", view, undefined, { tabindex: "0", role: "img", "aria-label": `${run.scene} in motion; arrow keys turn it` });
    if (!run.time.length) make("p", view, "No step was made: there is nothing to see.", { role: "status" });
    if (run.early) make("p", view, `The end: ${run.early}.`, { role: "status" });
    listen(canvas);
    pictures.push(new Picture(canvas));
    for (const [time, name] of run.events) {
      make("button", by("events"), `${time.toFixed(2)} s: ${name}`).addEventListener("click", () => seek(time));
    }
  }
  const slider = by("time");
  Object.assign(slider, { min: span[0], max: span[1], step: "any" });
  state.time = span[0];
  slider.addEventListener("input", () => { play(false); seek(Number(slider.value)); });
  by("play").addEventListener("click", () => play(!state.playing));
  by("speed").addEventListener("change", (event) => { state.speed = Number(event.target.value); });
  by("colour").addEventListener("change", (event) => { state.colour = Number(event.target.value); legend(); redraw(); });
  by("forces").addEventListener("change", (event) => { state.forces = event.target.checked; redraw(); });
  by("fit").addEventListener("click", () => { fit(); redraw(); });
  makePlots();
  fit();
  legend();
  const all = () => { drawPlots(); show(); };
  all();
  new ResizeObserver(all).observe(by("views"));
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => { readStyle(); all(); });
};
// For programs that look on.
window.replay = { state, frames, camera, span, seek, play, show, ready: begin() };
