// Plots, and ways to look: for recordings and for what goes on. `picture.js` comes before.

// --- Plots, in step with the picture.
const plots = [];
const span = [Infinity, -Infinity];
const short = (x) => (x === 0 ? "0" : Math.abs(x) >= 1e4 || Math.abs(x) < 1e-2 ? x.toExponential(1) : String(+x.toPrecision(3)));
// Fits the scale to the numbers, which may have changed.
const scalePlot = (plot) => {
  const { title, unit, series, log } = plot;
  let [low, high] = [Infinity, -Infinity];
  for (const { y } of series) for (const v of y) if (Number.isFinite(v) && (!log || v > 0)) [low, high] = [Math.min(low, v), Math.max(high, v)];
  plot.box.hidden = low > high;
  if (low === high) [low, high] = log ? [low / 2, high * 2] : [low - (Math.abs(low) / 2 || 1), high + (Math.abs(high) / 2 || 1)];
  plot.canvas.setAttribute("aria-label", `${title} over time, from ${short(low)} to ${short(high)} ${unit}`);
  [plot.low, plot.high] = [low, high];
};
const addPlot = (title, unit, series, log = false) => {
  const box = make("div", by("plots"), undefined, { class: "plot" });
  make("h2", box, `${title} (${unit})`);
  const canvas = make("canvas", box, undefined, { role: "img" });
  const cursor = make("div", box, undefined, { class: "cursor" });
  canvas.addEventListener("pointerdown", (event) => {
    const { left, width } = canvas.getBoundingClientRect();
    seek(span[0] + ((event.clientX - left) / width) * (span[1] - span[0]));
  });
  const plot = { title, unit, box, canvas, cursor, series, log };
  plots.push(plot);
  scalePlot(plot);
};
const drawPlots = () => {
  for (const { canvas, series, low, high, log } of plots.filter(({ box }) => !box.hidden)) {
    const scale = Math.min(window.devicePixelRatio || 1, 2);
    const [w, h, ctx] = [canvas.clientWidth, canvas.clientHeight, canvas.getContext("2d")];
    [canvas.width, canvas.height] = [w * scale, h * scale];
    ctx.setTransform(scale, 0, 0, scale, 0, 0);
    const of = log ? Math.log : (v) => v;
    const y = (v) => h - 4 - ((of(v) - of(low)) / (of(high) - of(low))) * (h - 8);
    const x = (t) => ((t - span[0]) / (span[1] - span[0] || 1)) * w;
    for (const { x: times, y: values, dash, colour } of series) {
      ctx.beginPath();
      ctx.setLineDash(dash);
      let pen = false;
      values.forEach((v, k) => {
        const shown = Number.isFinite(v) && (!log || v > 0);
        if (shown) pen ? ctx.lineTo(x(times[k]), y(v)) : ctx.moveTo(x(times[k]), y(v));
        pen = shown;
      });
      Object.assign(ctx, { strokeStyle: style[colour], lineWidth: 1.3 });
      ctx.stroke();
    }
    ctx.setLineDash([]);
    Object.assign(ctx, { fillStyle: style.quiet, font: "11px system-ui, sans-serif" });
    ctx.fillText(short(high), 2, 11);
    ctx.fillText(short(low), 2, h - 3);
    for (const { label, colour, k } of series.filter((s) => s.label).map((s, k) => ({ ...s, k }))) {
      ctx.fillStyle = style[colour];
      ctx.textAlign = "right";
      ctx.fillText(label, w - 4, 11 + 13 * k);
      ctx.textAlign = "left";
    }
  }
};

// --- The camera, by pointer and keys.
const legend = () => {
  const [low, high] = ranges[state.colour] ?? [0, 0];
  by("scale").style.background = `linear-gradient(to right, ${[0, 0.25, 0.5, 0.75, 1].map(hue).join()})`;
  const text = `${short(low)} … ${short(high)} ${UNITS[state.colour]}`;
  if (by("range").textContent !== text) by("range").textContent = text;
};
const zoom = (by) => { camera.distance = Math.max(camera.extent * 0.02, Math.min(camera.extent * 20, camera.distance * by)); redraw(); };
const orbit = (dx, dy) => {
  camera.yaw -= dx;
  camera.pitch = Math.max(-1.5, Math.min(1.5, camera.pitch + dy));
  redraw();
};
const pan = (dx, dy) => {
  const { right, up } = eyes();
  camera.target = add(add(camera.target, right, -dx * camera.distance), up, dy * camera.distance);
  redraw();
};
const pointers = new Map();
const listen = (canvas) => {
  canvas.addEventListener("pointerdown", (event) => {
    canvas.setPointerCapture(event.pointerId);
    pointers.set(event.pointerId, event);
  });
  for (const end of ["pointerup", "pointercancel"]) canvas.addEventListener(end, (event) => pointers.delete(event.pointerId));
  canvas.addEventListener("pointermove", (event) => {
    const before = pointers.get(event.pointerId);
    if (!before) return;
    const [dx, dy] = [event.clientX - before.clientX, event.clientY - before.clientY];
    const other = [...pointers.values()].find((p) => p.pointerId !== event.pointerId);
    pointers.set(event.pointerId, event);
    if (other) {
      const apart = (p) => Math.hypot(p.clientX - other.clientX, p.clientY - other.clientY) || 1;
      zoom(apart(before) / apart(event));
    } else if (event.shiftKey || event.buttons > 1) pan(dx / canvas.clientHeight, dy / canvas.clientHeight);
    else orbit(dx * 0.008, dy * 0.008);
  });
  canvas.addEventListener("contextmenu", (event) => event.preventDefault());
  canvas.addEventListener("wheel", (event) => { event.preventDefault(); zoom(Math.exp(event.deltaY * 0.001)); }, { passive: false });
  canvas.addEventListener("keydown", (event) => {
    const turn = { ArrowLeft: [0.1, 0], ArrowRight: [-0.1, 0], ArrowUp: [0, 0.1], ArrowDown: [0, -0.1] }[event.key];
    if (!turn) return;
    event.preventDefault();
    event.stopPropagation();
    if (event.shiftKey) pan(...turn.map((x) => -x)); else orbit(...turn);
  });
};
