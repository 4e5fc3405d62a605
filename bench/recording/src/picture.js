"use strict";
// What is seen of a frame. `page.js`, or the page of a run that goes on, has what happens around it.
// One run, or two side by side.
const runs = JSON.parse(document.getElementById("data").textContent);
const by = (id) => document.getElementById(id);
const make = (tag, parent, text, attributes = {}) => {
  const made = document.createElement(tag);
  if (text !== undefined) made.textContent = text;
  for (const [name, value] of Object.entries(attributes)) made.setAttribute(name, value);
  parent?.append(made);
  return made;
};

// --- Numbers: what `planes.rs` has encoded.
const inflated = async (text) => {
  const bytes = Uint8Array.from(atob(text), (c) => c.charCodeAt(0));
  const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("deflate-raw"));
  return new Uint8Array(await new Response(stream).arrayBuffer());
};
const decoded = (bytes, at, width, frames) => {
  const count = width * frames;
  const values = new Int32Array(count);
  for (let channel = 0; channel < width; channel++) {
    const order = bytes[at + channel];
    let [last, before] = [0, 0];
    for (let frame = 0; frame < frames; frame++) {
      const place = at + width + channel * frames + frame;
      const z = bytes[place] | (bytes[place + count] << 8) | (bytes[place + 2 * count] << 16) | (bytes[place + 3 * count] << 24);
      const d = (z >>> 1) ^ -(z & 1);
      const x = (d + (order === 0 ? 0 : order === 1 ? last : 2 * last - before)) | 0;
      [before, last] = [last, x];
      values[frame * width + channel] = x;
    }
  }
  return values;
};
const OF_CONTACT = 10;
const load = async (run) => {
  let first = 0;
  run.time = run.parts.flatMap((part) => part.times);
  const layouts = JSON.parse(new TextDecoder().decode(await inflated(run.layouts)));
  for (const [k, part] of run.parts.entries()) {
    part.layout = layouts[k];
    const [bytes, { channels }] = [await inflated(part.data), part.layout];
    const [width, frames] = [channels.length, part.times.length];
    const raw = decoded(bytes, 0, width, frames);
    part.values = new Float32Array(raw.buffer);
    channels.forEach(({ step }, channel) => {
      if (step === null) return;
      for (let k = channel; k < raw.length; k += width) part.values[k] = raw[k] * step;
    });
    part.begins = [0];
    part.counts.forEach((count, k) => part.begins.push(part.begins[k] + count));
    const touching = part.begins[frames];
    part.sides = decoded(bytes, width + 4 * width * frames, OF_CONTACT, touching);
    part.contacts = new Float32Array(part.sides.buffer);
    part.names = new Map(channels.map(({ name }, channel) => [name, channel]));
    part.units = new Map(channels.map(({ name, unit }) => [name, unit]));
    [part.first, part.width] = [first, width];
    first += frames;
    part.held = holding(part);
  }
};
const column = (run, name) => {
  const all = new Float32Array(run.time.length).fill(NaN);
  for (const part of run.parts) {
    const channel = part.names.get(name);
    if (channel === undefined) continue;
    // Recordings made before hold the error in m.
    const scale = name === "error" && part.units.get(name) === "m" ? 1e3 : 1;
    for (let k = 0; k < part.times.length; k++) all[part.first + k] = scale * part.values[k * part.width + channel];
  }
  return all;
};
// The frame at a time or before it, its part, and how far it is on the way to the next.
const at = (run, time) => {
  let [low, high] = [0, run.time.length - 1];
  while (low < high) {
    const middle = (low + high + 1) >> 1;
    if (run.time[middle] <= time + 1e-9) low = middle; else high = middle - 1;
  }
  const part = run.parts.findLast((p) => p.first <= low);
  const frame = low - part.first;
  const next = frame + 1 < part.times.length ? part.times[frame + 1] : Infinity;
  const share = Math.max(0, Math.min(1, (time - part.times[frame]) / (next - part.times[frame])));
  return { run, part, frame, share };
};
const number = ({ part, frame, share }, channel) => {
  const k = frame * part.width + channel;
  const x = part.values[k];
  return share > 0 ? x + share * (part.values[k + part.width] - x) : x;
};
// A number that does not go on smoothly: what the frame itself has.
const own = ({ part, frame }, channel) => part.values[frame * part.width + channel];

// --- Vectors and turns.
const add = (a, b, s = 1) => [a[0] + s * b[0], a[1] + s * b[1], a[2] + s * b[2]];
const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
const norm = (a) => Math.hypot(...a);
const times = (a, s) => [a[0] * s, a[1] * s, a[2] * s];
const rotated = ([w, x, y, z], v) => {
  const t = times(cross([x, y, z], v), 2);
  return add(add(v, t, w), cross([x, y, z], t));
};
const WORLD = { x: [0, 0, 0], q: [1, 0, 0, 0] };
const pose = (now, body) => {
  if (body === null) return WORLD;
  const { pose: k } = now.part.layout.bodies[body];
  const q = [3, 4, 5, 6].map((i) => number(now, k + i));
  const size = Math.hypot(...q) || 1;
  return { x: [0, 1, 2].map((i) => number(now, k + i)), q: q.map((c) => c / size) };
};
const placed = ({ x, q }, point) => add(x, rotated(q, point));
const pointOf = (now, point) => (point.moved === null ? placed(pose(now, point.body), point.at)
  : [0, 1, 2].map((i) => number(now, point.moved + i)));
const loadOf = (now) => (now.part.layout.load === null ? null : pose(now, now.part.layout.load).x);

// Ends of a capsule in the frame of its body.
const ends = (now, solid) => {
  const { length: fixed } = solid.shape.capsule ?? solid.shape.cylinder;
  const length = solid.length === null ? fixed : own(now, solid.length);
  const half = rotated(solid.turn, [0, 0, length / 2]);
  return [add(solid.at, half, -1), add(solid.at, half)];
};

// The points of a line: straight spans, and arcs on its sheaves.
const path = (now, line) => {
  const points = [];
  for (const point of line.points) {
    const { sheave } = point;
    if (!sheave) { points.push(pointOf(now, point)); continue; }
    let [from, to] = [own(now, sheave.lay), own(now, sheave.lay + 1)];
    if (!Number.isFinite(to - from)) continue;
    from = Math.max(from, to - 2 * Math.PI);
    const [{ q }, hub] = [pose(now, point.body), pointOf(now, point)];
    const [v, w] = sheave.axes.map((axis) => rotated(q, axis));
    const count = Math.max(2, Math.ceil((to - from) / 0.3));
    for (let k = 0; k <= count; k++) {
      const angle = from + ((to - from) * k) / count;
      points.push(add(add(hub, v, sheave.radius * Math.cos(angle)), w, sheave.radius * Math.sin(angle)));
    }
  }
  return points;
};

// The segment that is next to the load, which shows where its tension pulls.
const holding = (part) => {
  const { layout } = part;
  const now = { part, frame: 0, share: 0 };
  const load = loadOf(now);
  let [nearest, found] = [Infinity, null];
  for (const body of load ? layout.cables.flatMap((cable) => cable.bodies) : []) {
    const there = pose(now, body);
    const two = ends(now, layout.bodies[body].solids[0]).map((p) => norm(add(placed(there, p), load, -1)));
    if (Math.min(...two) < nearest) [nearest, found] = [Math.min(...two), { body, away: two[0] > two[1] ? 0 : 1 }];
  }
  return found;
};

// --- Colours.
const STOPS = [[76, 111, 224], [42, 165, 184], [108, 194, 74], [240, 180, 41], [228, 87, 46]];
const hue = (share) => {
  const x = Math.max(0, Math.min(1, share)) * (STOPS.length - 1);
  const k = Math.min(STOPS.length - 2, Math.floor(x));
  return `rgb(${[0, 1, 2].map((i) => Math.round(STOPS[k][i] + (x - k) * (STOPS[k + 1][i] - STOPS[k][i]))).join()})`;
};
const QUANTITIES = ["tension", "bending", "twist"];
const UNITS = ["N", "N m", "N m"];
const mean = (now, channels) => {
  const all = channels.map((channel) => own(now, channel)).filter(Number.isFinite);
  return all.length ? all.reduce((a, b) => a + b) / all.length : NaN;
};
let style = {};
const readStyle = () => {
  const css = getComputedStyle(document.documentElement);
  for (const name of ["back", "ink", "quiet", "line", "solid", "load", "edge", "force", "second"]) {
    style[name] = css.getPropertyValue(`--${name}`).trim();
  }
};

// --- The picture: perspective, far things first.
const camera = { target: [0, 0, 0], yaw: -1.1, pitch: 0.25, distance: 10, extent: 10 };
const eyes = () => {
  const [cy, sy, cp, sp] = [Math.cos(camera.yaw), Math.sin(camera.yaw), Math.cos(camera.pitch), Math.sin(camera.pitch)];
  const away = [cp * cy, cp * sy, sp];
  return { away, right: [-sy, cy, 0], up: [-sp * cy, -sp * sy, cp] };
};
const fit = () => {
  const [low, high] = [[Infinity, Infinity, Infinity], [-Infinity, -Infinity, -Infinity]];
  const see = (p, r = 0) => p.forEach((x, i) => {
    if (Number.isFinite(x)) [low[i], high[i]] = [Math.min(low[i], x - r), Math.max(high[i], x + r)];
  });
  for (const run of runs) for (const part of run.parts) {
    const { bodies, lines, anchors } = part.layout;
    const stride = Math.max(1, Math.floor(part.times.length / 40));
    for (let frame = 0; frame < part.times.length; frame += stride) {
      const now = { part, frame, share: 0 };
      bodies.forEach((body, i) => {
        const box = body.solids[0]?.shape.box ?? body.solids[0]?.shape.sphere;
        see(pose(now, i).x, box ? (box.radius ?? Math.max(...box.size) / 2) : 0);
      });
      [...lines.flatMap((line) => line.points), ...anchors].forEach((point) => see(pointOf(now, point)));
    }
  }
  if (low[0] > high[0]) return;
  camera.extent = Math.max(norm(add(high, low, -1)), 0.1);
  camera.target = times(add(low, high), 0.5);
  [camera.yaw, camera.pitch, camera.distance] = [-1.1, 0.25, camera.extent * 1.25];
};
class Picture {
  constructor(canvas) {
    [this.canvas, this.ctx] = [canvas, canvas.getContext("2d")];
  }
  begin() {
    const [w, h] = [this.canvas.clientWidth, this.canvas.clientHeight];
    // No more than two million pixels, for those who draw them without hardware.
    const scale = Math.min(window.devicePixelRatio || 1, 2, Math.sqrt(2e6 / (w * h || 1)));
    if (this.canvas.width !== Math.round(w * scale)) this.canvas.width = Math.round(w * scale);
    if (this.canvas.height !== Math.round(h * scale)) this.canvas.height = Math.round(h * scale);
    this.ctx.setTransform(scale, 0, 0, scale, 0, 0);
    this.ctx.fillStyle = style.back;
    this.ctx.fillRect(0, 0, w, h);
    Object.assign(this, eyes(), { w, h, focus: Math.min(w * 1.3, h * 1.1), items: [] });
    this.near = camera.distance * 0.02;
  }
  // Across, up and away from the eye.
  seen(p) {
    const d = add(p, camera.target, -1);
    return [dot(d, this.right), dot(d, this.up), camera.distance - dot(d, this.away)];
  }
  put([x, y, z]) {
    const s = this.focus / Math.max(z, this.near);
    return [this.w / 2 + x * s, this.h / 2 - y * s, s];
  }
  add(depth, draw) { this.items.push({ depth, draw }); }
  end() {
    this.items.sort((a, b) => b.depth - a.depth);
    for (const item of this.items) item.draw(this.ctx);
  }
  trace(points, close) {
    this.ctx.beginPath();
    points.forEach(([x, y], k) => (k ? this.ctx.lineTo(x, y) : this.ctx.moveTo(x, y)));
    if (close) this.ctx.closePath();
  }
  // A straight piece, cut where it passes behind the eye.
  segment(a, b) {
    let [p, q] = [this.seen(a), this.seen(b)];
    if (p[2] < this.near && q[2] < this.near) return null;
    if (p[2] < q[2]) [p, q] = [q, p];
    if (q[2] < this.near) q = add(p, add(q, p, -1), (p[2] - this.near) / (p[2] - q[2]));
    return [this.put(p), this.put(q), (p[2] + q[2]) / 2];
  }
  stroke(points, colour, width) {
    this.trace(points);
    Object.assign(this.ctx, { strokeStyle: colour, lineWidth: width, lineCap: "round", lineJoin: "round" });
    this.ctx.stroke();
  }
  capsule(a, b, radius, side, colour) {
    const cut = this.segment(a, b);
    if (!cut) return;
    const [p, q, depth] = cut;
    const width = Math.max(5, 2 * radius * this.focus / depth);
    this.add(depth, () => {
      // An edge around each would hide what is shorter than it is wide.
      if (Math.hypot(q[0] - p[0], q[1] - p[1]) > 2 * width) this.stroke([p, q], style.edge, width + 1.5);
      this.stroke([p, q], colour, width);
      // The stripe lies along the body's own side: it winds around a cable as that is twisted.
      const eye = dot(side, this.away);
      if (eye < 0.05) return;
      const [dx, dy] = [q[0] - p[0], q[1] - p[1]];
      const size = Math.hypot(dx, dy) || 1;
      const across = [dot(side, this.right), -dot(side, this.up)];
      const off = (across[0] * -dy + across[1] * dx) / size * width * 0.42;
      const shift = ([x, y]) => [x - dy / size * off, y + dx / size * off];
      this.stroke([p, q].map(shift), style.edge, Math.max(1, width * 0.16 * Math.sqrt(eye)));
    });
  }
  // A convex solid of faces, each a list of corners seen from outside in the positive sense.
  convex(corners, faces, centre, colour) {
    const seen = corners.map((p) => this.seen(p));
    if (seen.some((p) => p[2] < this.near)) return;
    const flat = seen.map((p) => this.put(p));
    this.add(this.seen(centre)[2], (ctx) => {
      for (const face of faces) {
        const [a, b, c] = [flat[face[0]], flat[face[1]], flat[face[2]]];
        if ((b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]) >= 0) continue;
        const normal = cross(add(corners[face[1]], corners[face[0]], -1), add(corners[face[2]], corners[face[1]], -1));
        this.trace(face.map((k) => flat[k]), true);
        ctx.fillStyle = colour;
        ctx.fill();
        ctx.fillStyle = `rgba(0,0,0,${(0.28 * (1 - Math.max(0, normal[2] / (norm(normal) || 1)))).toFixed(2)})`;
        ctx.fill();
        Object.assign(ctx, { strokeStyle: style.edge, lineWidth: 1, lineJoin: "round" });
        ctx.stroke();
      }
    });
  }
  ball(centre, radius, colour) {
    const seen = this.seen(centre);
    if (seen[2] < this.near) return;
    const [x, y, s] = this.put(seen);
    this.add(seen[2], (ctx) => {
      ctx.beginPath();
      ctx.arc(x, y, Math.max(3, radius * s), 0, 2 * Math.PI);
      Object.assign(ctx, { fillStyle: colour, strokeStyle: style.edge, lineWidth: 1 });
      ctx.fill();
      ctx.stroke();
    });
  }
  line(points, colour, width) {
    for (let k = 1; k < points.length; k++) {
      const cut = this.segment(points[k - 1], points[k]);
      if (cut) this.add(cut[2], () => this.stroke(cut.slice(0, 2), colour, width));
    }
  }
  // A force, so many metres a newton, but no longer than half of what is seen.
  arrow(from, force, length) {
    const tip = add(from, force, Math.sign(length) * Math.min(Math.abs(length), (0.5 * camera.extent) / (norm(force) || 1)));
    const cut = this.segment(from, tip);
    if (!cut || this.seen(tip)[2] < this.near) return;
    const [[ax, ay], [bx, by]] = [this.put(this.seen(from)), this.put(this.seen(tip))];
    const [dx, dy] = [bx - ax, by - ay];
    const size = Math.hypot(dx, dy);
    if (size < 2) return;
    const [ux, uy, head] = [dx / size, dy / size, Math.min(9, size)];
    this.add(-1, (ctx) => {
      this.stroke([[ax, ay], [bx - ux * head, by - uy * head]], style.force, 2.5);
      this.trace([[bx, by], [bx - ux * head - uy * 4, by - uy * head + ux * 4],
        [bx - ux * head + uy * 4, by - uy * head - ux * 4]], true);
      ctx.fillStyle = style.force;
      ctx.fill();
    });
  }
}
const BOX = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
const round = (a, b, radius) => {
  const axis = add(b, a, -1);
  const v = cross(axis, Math.abs(axis[0]) < 0.7 * norm(axis) ? [1, 0, 0] : [0, 1, 0]);
  const [e, n] = [times(v, radius / (norm(v) || 1)), 18];
  const f = times(cross(axis, e), 1 / (norm(axis) || 1));
  const ring = (c) => Array.from({ length: n }, (_, k) => {
    const angle = (2 * Math.PI * k) / n;
    return add(add(c, e, Math.cos(angle)), f, Math.sin(angle));
  });
  const all = Array.from({ length: n }, (_, k) => k);
  const sides = all.map((k) => [k, (k + 1) % n, n + ((k + 1) % n), n + k]);
  return [[...ring(a), ...ring(b)], [[...all].reverse(), all.map((k) => n + k), ...sides]];
};
const drawSolid = (picture, now, there, solid, colour, side) => {
  const { shape } = solid;
  const centre = placed(there, solid.at);
  if (shape === "ground") return;
  if (shape.sphere) picture.ball(centre, shape.sphere.radius, colour);
  else if (shape.capsule) {
    const [a, b] = ends(now, solid).map((p) => placed(there, p));
    picture.capsule(a, b, shape.capsule.radius, side, colour);
  } else if (shape.cylinder) {
    const [a, b] = ends(now, solid).map((p) => placed(there, p));
    picture.convex(...round(a, b, shape.cylinder.radius), centre, colour);
  } else if (shape.box) {
    const half = shape.box.size.map((x) => Math.max(x, 0.004 * camera.extent) / 2);
    const corners = [0, 1, 2, 3, 4, 5, 6, 7].map((k) => {
      const corner = [0, 1, 2].map((i) => (k & (1 << i) ? half[i] : -half[i]));
      return placed(there, add(solid.at, rotated(solid.turn, corner)));
    });
    picture.convex(corners, BOX, centre, colour);
  } else picture.ball(centre, 0.006 * camera.extent, colour);
};
const drawGround = (picture, { at: place, turn }) => {
  const [u, v, n] = [[1, 0, 0], [0, 1, 0], [0, 0, 1]].map((axis) => rotated(turn, axis));
  // Below what is looked at.
  const middle = add(camera.target, n, dot(add(place, camera.target, -1), n));
  const [count, step] = [10, 10 ** Math.round(Math.log10(camera.extent / 8))];
  const snapped = add(add(place, u, Math.round(dot(add(middle, place, -1), u) / step) * step),
    v, Math.round(dot(add(middle, place, -1), v) / step) * step);
  for (let k = -count; k <= count; k++) for (const [along, across] of [[u, v], [v, u]]) {
    const from = add(snapped, across, k * step);
    const cut = picture.segment(add(from, along, -count * step), add(from, along, count * step));
    if (cut) picture.stroke(cut.slice(0, 2), style.line, 1);
  }
};
const drawLoadForces = (picture, now) => {
  const { run, part } = now;
  const { bodies, load: i, lines } = part.layout;
  if (i === null) return;
  const [{ mass }, there] = [bodies[i], pose(now, i)];
  const scale = (0.18 * camera.extent) / run.force;
  picture.arrow(there.x, times(run.gravity, mass), scale);
  const tension = own(now, part.names.get("load_tension"));
  let pulls = lines.flatMap((line) => line.points.map((point, k) => ({ line, point, k })));
  pulls = pulls.filter(({ line, point }) => point.body === i && line.tension !== null);
  for (const { line, point, k } of pulls) for (const next of [line.points[k - 1], line.points[k + 1]]) {
    if (!next) continue;
    const from = pointOf(now, point);
    const d = add(pointOf(now, next), from, -1);
    const size = own(now, line.tension) / (norm(d) || 1);
    if (Number.isFinite(size)) picture.arrow(from, times(d, size), scale);
  }
  if (!pulls.length && part.held && Number.isFinite(tension)) {
    const segment = pose(now, part.held.body);
    const two = ends(now, bodies[part.held.body].solids[0]).map((p) => placed(segment, p));
    if (part.held.away === 1) two.reverse();
    const d = add(two[0], two[1], -1);
    picture.arrow(there.x, times(d, tension / (norm(d) || 1)), scale);
  }
};
const draw = (picture, run) => {
  picture.begin();
  if (!run.time.length) return;
  const now = at(run, state.time);
  const { bodies, lines, anchors, world, load: loaded } = now.part.layout;
  world.filter((solid) => solid.shape === "ground").forEach((solid) => drawGround(picture, solid));
  world.forEach((solid) => drawSolid(picture, now, WORLD, solid, style.line, [0, 0, 1]));
  const [low, high] = ranges[state.colour] ?? [0, 0];
  const coloured = (x) => (Number.isFinite(x) ? hue((x - low) / (high - low || 1)) : style.solid);
  bodies.forEach((body, i) => {
    const there = pose(now, i);
    const channels = body.loads[state.colour];
    const plain = i === loaded ? style.load : style.solid;
    const colour = channels.length ? coloured(mean(now, channels)) : plain;
    for (const solid of body.solids) {
      drawSolid(picture, now, there, solid, colour, rotated(there.q, rotated(solid.turn, [1, 0, 0])));
    }
  });
  for (const line of lines) {
    const colour = state.colour === 0 && line.tension !== null ? coloured(own(now, line.tension)) : style.quiet;
    picture.line(path(now, line), colour, 3);
    for (const point of line.points.filter((p) => p.sheave)) {
      const [hub, { q }] = [pointOf(now, point), pose(now, point.body)];
      const [v, w] = point.sheave.axes.map((axis) => times(rotated(q, axis), point.sheave.radius));
      const ring = Array.from({ length: 25 }, (_, k) => add(add(hub, v, Math.cos(k * Math.PI / 12)), w, Math.sin(k * Math.PI / 12)));
      picture.line(ring, style.quiet, 1.5);
      picture.line([hub, add(hub, v)], style.quiet, 1.5);
    }
  }
  for (const anchor of anchors) picture.ball(pointOf(now, anchor), 0, style.ink);
  if (state.forces) {
    drawLoadForces(picture, now);
    const { part, frame } = now;
    for (let k = part.begins[frame]; k < part.begins[frame + 1]; k++) {
      const [x, y, z, ...force] = part.contacts.subarray(k * OF_CONTACT + 4, (k + 1) * OF_CONTACT);
      // On the body, where the world is the first side.
      const side = part.sides[k * OF_CONTACT] < 0 ? -1 : 1;
      if (force.every(Number.isFinite)) picture.arrow([x, y, z], force, (side * 0.18 * camera.extent) / run.force);
    }
  }
  picture.end();
};

