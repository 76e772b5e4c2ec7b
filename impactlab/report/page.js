
// The live part of a page: an animated scene, the diagram of place and time, time traces, a table that sorts.
// All of it follows one state: the time, the history shown, the stretch of displacements, the methods switched off.

const data = JSON.parse(document.getElementById("data").textContent);
function firstFilm() { // of a comparison the exact solution, or the first run that kept its fields where that has none
  const ink = data.compared ? data.methods.findIndex((m) => m.colour === "ink") : 0;
  const keeps = (film) => Object.keys(film.chains).length > 0 || Object.values(film.bodies).some((body) => body.same || body.load);
  return ink > 0 && !keeps(data.films[ink]) ? Math.max(0, data.films.findIndex(keeps)) : Math.max(0, ink);
}
const state = { duration: data.duration, time: 0.25 * data.duration, film: firstFilm(), stretch: 1, playing: false, off: new Set() };
const RUN_SECONDS = 8; // of the screen, for a whole run at speed 1
const MAX_ICON = 34; // px, of a mass or a wall; less where many stand in a row
const ICONS_SHARE = 0.7; // of the width, that masses and walls may take
const SHORT = 0.03; // of the whole train: the load of shorter bodies does not widen the scale of colours
const MANY = 10; // %, above which the axis of the energy balance is linear near zero only
const ROUNDING = 1e-4; // of the axis of a signal, to which its values are rounded
const PAD = { left: 58, right: 20, top: 14, bottom: 44 }; // px, around the diagram

// ---- axes of time and place ----
const clock = scaled("s", data.duration);
function nice(value) { // the largest 1, 2 or 5 times a power of ten below it
  const power = 10 ** Math.floor(Math.log10(value));
  return ([5, 2, 1].find((lead) => lead * power <= value * 1.0001) || 1) * power;
}
function ticks(low, high, count) {
  const step = nice((high - low) / count) || 1;
  const found = [];
  for (let i = Math.ceil(low / step - 1e-9); i * step <= high + 1e-9 * step; i++) found.push(i * step);
  return found;
}

// ---- arrays ----
async function unpack(text) { // as impactlab/report/page_data.py packs them
  const planes = await inflated(text);
  const count = planes.length / 2;
  return ([first, size, low, step]) => {
    const values = new Float64Array(size);
    for (let i = 0, code = 0; i < size; i++) {
      code = (code + planes[first + i] + 256 * planes[count + first + i]) & 0xffff;
      values[i] = code === 0xffff ? NaN : low + code * step;
    }
    return values;
  };
}
function extremes(values) {
  let low = Infinity, high = -Infinity;
  for (const value of values) { if (value < low) low = value; if (value > high) high = value; }
  return [low, high];
}

// ---- colours of stress, torque and deflection ----
const RAMPS = {
  light: ["#123f8f", "#7fb0e3", "#f4f4f2", "#f0a07c", "#9d1b17"],
  dark: ["#a5d2ff", "#3b7fd6", "#242b34", "#cf5a35", "#ffc19c"],
};
let ramp = []; // 255 colours as [r, g, b], the middle one of zero
function makeRamp() {
  const stops = RAMPS[dark.matches ? "dark" : "light"].map((c) => [1, 3, 5].map((i) => parseInt(c.slice(i, i + 2), 16)));
  ramp = Array.from({ length: 255 }, (_, i) => {
    const at = (i / 254) * (stops.length - 1), k = Math.min(Math.floor(at), stops.length - 2);
    return stops[k].map((from, j) => Math.round(from + (at - k) * (stops[k + 1][j] - from)));
  });
}
const limits = {}; // unit -> largest value on the scale of colours
const colour = (value, unit) => ramp[Math.round(127 + 127 * Math.max(-1, Math.min(1, value / (limits[unit] || 1))))];
const rgb = (c) => `rgb(${c[0]} ${c[1]} ${c[2]})`;

// ---- the films: motion and load of every body at the frames ----
let films = [];
function readFilms(array) {
  films = data.films.map((film) => {
    const bodies = {};
    for (const [name, body] of Object.entries(film.bodies)) {
      const read = (field) => field && { frames: field[0], n: field[1], values: array(field[2]) }, u = read(body.u);
      bodies[name] = { u, load: body.same ? u : read(body.load) };
    }
    const read = (field) => field && { frames: field[0], n: field[1], values: array(field[2]) };
    const chains = Object.fromEntries(Object.entries(film.chains).map(([name, field]) => [name, read(field)]));
    return { ...film, bodies, chains, gaps: film.gaps.map(read) };
  });
  for (const body of data.bodies) {
    if (!body.unit || body.length < SHORT * whole) continue;
    const known = [films.length - 1, 0, ...films.keys()].map((i) => data.films[i].bodies[body.name].largest).find((v) => v > 0);
    limits[body.unit] = Math.max(limits[body.unit] || 0, known || 0);
  }
}
function at(field, share, time) { // a field at a share of the length, between frames and places
  const f = Math.min((time / data.duration) * (field.frames - 1), field.frames - 1);
  const k = Math.min(Math.floor(f), field.frames - 2), p = share * (field.n - 1);
  const i = Math.min(Math.floor(p), Math.max(field.n - 2, 0)), j = Math.min(i + 1, field.n - 1);
  const along = (row) => field.values[row * field.n + i] * (1 - p + i) + field.values[row * field.n + j] * (p - i);
  return along(k) * (1 - f + k) + along(k + 1) * (f - k);
}
const motion = (body, share, time) => {
  const { u } = films[state.film].bodies[body.name];
  return body.gap + (u ? at(u, share, time) : 0);
};

// ---- the scene, to scale ----
const whole = Math.max(...data.bodies.map((b) => b.x + b.length), 0);
const icons = Math.max(...data.bodies.map((b) => b.icons + (b.length ? 0 : 1)), 0);
const bends = data.bodies.some((body) => body.kind === "beam");
let reach = 0, view = null, icon = MAX_ICON;
const STRETCHES = Array.from({ length: 22 }, (_, i) => [1, 2, 5][i % 3] * 10 ** Math.floor(i / 3));
function measure() { // the largest motion, and the stretch at which it is seen
  for (const film of films) for (const body of data.bodies) {
    const { u } = film.bodies[body.name];
    if (u) reach = Math.max(reach, ...extremes(u.values).map((v) => Math.abs(v + body.gap)));
  }
  const room = bends ? 0.05 * whole : 0.07 * (whole || 12 * reach);
  const wanted = reach > 0 && room > reach ? nice(room / reach) : 1;
  state.stretch = Math.max(...STRETCHES.filter((s) => s <= wanted * 1.001));
}
function project(width) { // metres along the train to px, with the room that the motion takes
  let low = 0, high = whole;
  for (const body of data.bodies) {
    const { u } = films[state.film].bodies[body.name];
    if (!u || bends) continue;
    const [least, most] = extremes(u.values);
    low = Math.min(low, body.x + state.stretch * (body.gap + least));
    high = Math.max(high, body.x + body.length + state.stretch * (body.gap + most));
  }
  const span = high - low || 1, margin = 26;
  const room = width - PAD.left - PAD.right - 2 * margin;
  icon = Math.min(MAX_ICON, ICONS_SHARE * room / Math.max(1, icons));
  const scale = (room - icons * icon) / span;
  return { width, scale, px: (x, before = 0) => PAD.left + margin + before * icon + (x - low) * scale };
}
function canvas(element, height) {
  const width = element.parentElement.clientWidth, ratio = devicePixelRatio || 1;
  element.width = Math.round(width * ratio);
  element.height = Math.round(height * ratio);
  element.style.height = `${height}px`;
  const pen = element.getContext("2d");
  pen.setTransform(ratio, 0, 0, ratio, 0, 0);
  pen.font = `12px ${css("sans")}`;
  return { pen, width, height };
}
let stage, pen, ink, muted, paper, accent, line;
const STAGE = data.chains.length ? 340 : bends ? 270 : 170, HALF = 22; // px: height of the scene, half the height of the tallest bar
const CROWD = 12; // bodies: of more, a name without room is left out
const axis = () => STAGE * (bends ? 0.5 : 0.46);
function hatch(x, y, half, side) {
  pen.strokeStyle = ink; pen.lineWidth = 1.6;
  pen.beginPath(); pen.moveTo(x, y - half); pen.lineTo(x, y + half); pen.stroke();
  pen.strokeStyle = muted; pen.lineWidth = 1; pen.beginPath();
  for (let at = y - half; at < y + half - 1; at += 8) { pen.moveTo(x, at + 8); pen.lineTo(x + side * 8, at); }
  pen.stroke();
}
function support(kind, x, y, side, half) {
  if (kind === "clamped") hatch(x, y, half + 9, side);
  pen.strokeStyle = ink; pen.fillStyle = ink; pen.lineWidth = 1.4;
  if (kind === "mass") pen.fillRect(side > 0 ? x : x - 12, y - 16, 12, 32);
  if (kind === "pinned") { pen.beginPath(); pen.moveTo(x, y + 4); pen.lineTo(x - 8, y + 18); pen.lineTo(x + 8, y + 18); pen.closePath(); pen.stroke(); }
  if (kind === "spring" || kind === "dashpot") {
    pen.beginPath(); pen.moveTo(x, y);
    if (kind === "spring") for (let i = 1; i < 8; i++) pen.lineTo(x + side * 3 * i, y + (i % 2 ? -6 : 6));
    else { pen.lineTo(x + side * 10, y); pen.moveTo(x + side * 10, y - 6); pen.lineTo(x + side * 10, y + 6); pen.moveTo(x + side * 7, y - 9); pen.lineTo(x + side * 16, y - 9); pen.lineTo(x + side * 16, y + 9); pen.lineTo(x + side * 7, y + 9); pen.moveTo(x + side * 16, y); }
    pen.lineTo(x + side * 24, y); pen.stroke();
    hatch(x + side * 24, y, 14, side);
  }
  if (kind === "infinite") { pen.setLineDash([4, 4]); pen.beginPath(); pen.moveTo(x, y); pen.lineTo(x + side * 26, y); pen.stroke(); pen.setLineDash([]); }
}
function pieceAt(body, share) {
  let left = share * body.length;
  for (const [length, height] of body.pieces) { if (left <= length) return height; left -= length; }
  return body.pieces.at(-1)[1];
}
const tall = (body, share) => 7 + (HALF - 7) * pieceAt(body, share);
const faceOf = (body, share, time) => view.px(body.x, body.icons) + (share * body.length + state.stretch * motion(body, share, time)) * view.scale;
const apart = (body) => bends ? 0 : state.stretch * body.gap * view.scale; // px, by the gaps at t = 0
const heightOf = (body, share, time) => axis() - state.stretch * motion(body, share, time) * view.scale;
function drawBar(body, time) {
  const { load } = films[state.film].bodies[body.name], cells = load ? load.n - 1 : 24;
  const upright = body.beside, place = upright && byName[body.beside];
  const foot = upright && heightOf(body, body.side > 0 ? 0 : 1, time) - body.side * 7;
  const edges = [];
  for (let i = 0; i <= cells; i++) edges.push(upright ? foot - body.side * 52 * (body.side > 0 ? i / cells : 1 - i / cells) : faceOf(body, i / cells, time));
  const y = axis(), x = upright && view.px(place.x + body.at, place.icons);
  for (let i = 0; i < cells; i++) {
    const half = upright ? 8 : tall(body, (i + 0.5) / cells);
    pen.fillStyle = load ? rgb(colour(at(load, (i + 0.5) / cells, time), body.unit)) : css("wash");
    const from = Math.min(edges[i], edges[i + 1]), long = Math.abs(edges[i + 1] - edges[i]) + (i < cells - 1 ? 1 : 0);
    if (upright) pen.fillRect(x - half, from, 2 * half, long); else pen.fillRect(from, y - half, long, 2 * half);
  }
  pen.strokeStyle = ink; pen.lineWidth = 1.2;
  if (upright) { pen.strokeRect(x - 8, Math.min(edges[0], edges[cells]), 16, Math.abs(edges[cells] - edges[0])); return; }
  let done = 0;
  for (const [length] of body.pieces) {
    const [from, to] = [faceOf(body, done / body.length, time), faceOf(body, Math.min(1, (done + length) / body.length), time)];
    const half = tall(body, (done + length / 2) / body.length);
    pen.strokeRect(from, y - half, to - from, 2 * half);
    done += length;
  }
  body.ends.forEach((kind, end) => support(kind, edges[end * cells], y, end ? 1 : -1, tall(body, end)));
}
function drawBeam(body, time) {
  const { u } = films[state.film].bodies[body.name], cells = 60;
  const x = (share) => view.px(body.x + share * body.length, body.icons);
  for (let i = 0; i < cells; i++) {
    const [a, b] = [i / cells, (i + 1) / cells];
    for (const [width, style] of [[9, ink], [6.5, u && u.n > 2 ? rgb(colour(at(u, (a + b) / 2, time), body.unit)) : css("wash")]]) {
      pen.strokeStyle = style; pen.lineWidth = width; pen.beginPath();
      pen.moveTo(x(a), heightOf(body, a, time)); pen.lineTo(x(b) + 0.5, heightOf(body, b, time)); pen.stroke();
    }
  }
  body.ends.forEach((kind, end) => support(kind, x(end), heightOf(body, end, time), end ? 1 : -1, 12));
}
function drawIcon(body, time) {
  const place = body.beside && byName[body.beside], size = 12 + 12 * (body.size || 1);
  pen.fillStyle = ink;
  if (place) {
    const x = view.px(place.x + body.at, place.icons), y = heightOf(body, 0, time) - body.side * 6;
    if (body.kind === "wall") { pen.save(); pen.translate(x, y); pen.rotate(Math.PI / 2); hatch(0, 0, 20, -body.side); pen.restore(); }
    else { pen.beginPath(); pen.arc(x, y - body.side * size / 2, size / 2, 0, 7); pen.fill(); }
    return;
  }
  const meets = data.contacts.some((contact) => contact.left[0] === body.name); // its face is its right side
  const x = faceOf(body, 0, time) + (meets ? icon : 0), y = axis();
  if (body.kind === "wall") hatch(x, y, HALF + 12, meets ? -1 : 1);
  else { pen.beginPath(); pen.roundRect(meets ? x - icon + 2 : x, y - size, icon - 2, 2 * size, 3); pen.fill(); pen.strokeStyle = paper; pen.lineWidth = 1; pen.stroke(); } // apart from those beside it
}
const byName = Object.fromEntries(data.bodies.map((body) => [body.name, body]));
function contactAt(contact, time) { // px of the face of a contact in the scene
  const [left, right] = [contact.left, contact.right].map(([name, x]) => ({ body: byName[name], x }));
  const beam = [left, right].find((side) => side.body.kind === "beam");
  if (beam) {
    const share = beam.x / beam.body.length, up = beam === left ? 1 : -1;
    return [view.px(beam.body.x + beam.x, beam.body.icons), heightOf(beam.body, share, time) - up * 5];
  }
  const side = left.body.length ? left : right.body.length ? right : left;
  const share = side.body.length ? side.x / side.body.length : 0;
  return [faceOf(side.body, share, time) + (side.body.length ? 0 : icon), axis()];
}
const isClosed = (number, time) => films[state.film].spans.some(([contact, start, end]) => contact === number && start <= time && time <= end);
function column(field, k, time) { // one of the numbers of a field, between frames
  const f = Math.min((time / data.duration) * (field.frames - 1), field.frames - 1), i = Math.min(Math.floor(f), field.frames - 2);
  return field.values[i * field.n + k] * (1 - f + i) + field.values[(i + 1) * field.n + k] * (f - i);
}
function drawChains(time) { // mechanisms to scale, with the bodies that they meet
  const film = films[state.film], fields = Object.values(film.chains);
  const range = (odd) => extremes(fields.flatMap(({ values }) => [...values.filter((_, i) => i % 2 === odd)]));
  const [[left, right], [low, high]] = [range(0), range(1)], margin = 44;
  const scale = Math.min((stage.width - 2 * margin) / (right - left || 1), (STAGE - 2 * margin) / (high - low || 1));
  const px = (x, y) => [stage.width / 2 + (x - (left + right) / 2) * scale, STAGE / 2 - (y - (low + high) / 2) * scale];
  const joint = (chain, i) => [0, 1].map((k) => column(film.chains[chain], 2 * i + k, time));
  for (const { name, slide } of data.chains) {
    const places = Array.from({ length: film.chains[name].n / 2 }, (_, i) => px(...joint(name, i)));
    if (slide !== null) { pen.strokeStyle = line; pen.lineWidth = 1; pen.beginPath(); pen.moveTo(0, px(0, slide)[1]); pen.lineTo(stage.width, px(0, slide)[1]); pen.stroke(); }
    pen.strokeStyle = ink; pen.lineWidth = 5; pen.lineCap = pen.lineJoin = "round"; pen.beginPath();
    for (const place of places) pen.lineTo(...place);
    pen.stroke();
    places.forEach((place, i) => { pen.fillStyle = paper; pen.lineWidth = 2; pen.beginPath(); pen.arc(...place, i ? 4.5 : 7, 0, 7); pen.fill(); pen.stroke(); });
  }
  pen.font = `12px ${css("sans")}`; pen.textAlign = "center";
  for (const { contact, chain, link, share, along, sign, kind, name } of data.met) {
    const [from, to] = [joint(chain, link), joint(chain, link + 1)], gap = film.gaps[contact];
    const [x, y] = px(...[0, 1].map((k) => from[k] + share * (to[k] - from[k])));
    const apart = gap ? sign * column(gap, 0, time) * scale : 0, way = sign > 0 ? 0 : Math.PI;
    if (isClosed(contact, time)) { pen.strokeStyle = accent; pen.lineWidth = 3; pen.beginPath(); pen.arc(x, y, 11, 0, 7); pen.stroke(); }
    pen.save(); pen.translate(x + apart * along[0], y - apart * along[1]); pen.rotate(way - Math.atan2(along[1], along[0]));
    if (kind === "wall") hatch(6, 0, 24, 1); else { pen.fillStyle = ink; pen.beginPath(); pen.roundRect(6, -14, 26, 28, 3); pen.fill(); }
    pen.restore();
    pen.fillStyle = muted; pen.fillText(name, x + (apart + sign * 19) * along[0], y - (apart + sign * 40) * along[1] + 4 - 28 * Math.abs(along[0]));
  }
}
function drawStage() {
  if (!pen) return;
  pen.clearRect(0, 0, view.width, STAGE);
  if (data.mechanism) { if (data.chains.length) drawChains(state.time); return; }
  for (const body of data.bodies) if (body.kind === "beam") drawBeam(body, state.time); else if (body.length) drawBar(body, state.time); else drawIcon(body, state.time);
  data.contacts.forEach((contact, number) => {
    if (!isClosed(number, state.time)) return;
    const [x, y] = contactAt(contact, state.time);
    pen.strokeStyle = accent; pen.lineWidth = 3; pen.beginPath();
    if (bends) { pen.arc(x, y, 7, 0, 7); } else { pen.moveTo(x, y - HALF - 9); pen.lineTo(x, y + HALF + 9); }
    pen.stroke();
  });
  pen.textAlign = "center"; pen.fillStyle = muted;
  const rows = [-Infinity, -Infinity, -Infinity];
  for (const body of [...data.bodies].sort((a, b) => a.x + a.length / 2 - b.x - b.length / 2 || a.icons - b.icons)) {
    const place = body.beside && byName[body.beside];
    const middle = () => view.px(body.x + body.length * (body.kind === "beam" ? 0.15 : 0.5), body.icons) + apart(body);
    const x = place ? view.px(place.x + body.at, place.icons) : body.length ? middle() : faceOf(body, 0, state.time) + icon / 2; // names of masses go with them
    const text = body.velocity ? `${body.name}, ${said(body.velocity, "m/s")}` : body.name;
    const half = pen.measureText(text).width / 2 + 5, mid = Math.max(half, Math.min(view.width - half, x));
    const free = rows.findIndex((end) => end < mid - half), row = Math.max(0, free);
    if (free < 0 && data.bodies.length > CROWD) continue;
    rows[row] = mid + half;
    if (place) pen.fillText(text, mid, axis() - state.stretch * body.gap * view.scale - body.side * ({ wall: 22, mass: 40, rod: 76 }[body.kind] || 40) + 4);
    else if (bends) pen.fillText(text, mid, axis() + (data.bodies.some((each) => each.beside === body.name && each.side < 0) ? -34 : 42));
    else pen.fillText(text, mid, axis() + HALF + 28 + 15 * row);
  }
}

// ---- the diagram of place and time ----
let diagram, base;
const DIAGRAM = 430; // px, its height
const timeY = (time) => DIAGRAM - PAD.bottom - (time / data.duration) * (DIAGRAM - PAD.bottom - PAD.top);
const placeX = (body, x) => body.beside && !body.length ? view.px(byName[body.beside].x + body.at, byName[body.beside].icons) : view.px(body.x + x, body.icons);
function drawDiagram() {
  if (data.mechanism) return;
  const { pen, width } = (diagram = canvas($("diagram"), DIAGRAM));
  const [top, bottom, film] = [timeY(data.duration), timeY(0), films[state.film]];
  pen.imageSmoothingEnabled = true; pen.imageSmoothingQuality = "high";
  for (const body of data.bodies) {
    if (!body.length) continue;
    const { load } = film.bodies[body.name], x = placeX(body, 0), wide = body.length * view.scale;
    if (load && load.n > 2) {
      const image = new ImageData(load.n, load.frames);
      for (let k = 0, to = 0; k < load.frames; k++) for (let i = 0; i < load.n; i++, to += 4) image.data.set([...colour(load.values[(load.frames - 1 - k) * load.n + i], body.unit), 255], to);
      const sheet = new OffscreenCanvas(load.n, load.frames);
      sheet.getContext("2d").putImageData(image, 0, 0);
      pen.drawImage(sheet, x, top, wide, bottom - top);
    } else { pen.fillStyle = css("wash"); pen.fillRect(x, top, wide, bottom - top); }
    pen.strokeStyle = line; pen.lineWidth = 1; pen.strokeRect(x, top, wide, bottom - top);
    if (!load) { pen.fillStyle = muted; pen.textAlign = "center"; const note = "no fields kept by this run"; if (pen.measureText(note).width < wide) pen.fillText(note, x + wide / 2, (top + bottom) / 2); }
  }
  if (!bends) for (const body of data.bodies) { // world lines of masses
    const { u } = film.bodies[body.name];
    if (body.length || !u || body.kind === "wall") continue;
    const right = data.contacts.some((contact) => contact.left[0] === body.name);
    pen.strokeStyle = ink; pen.lineWidth = 1.6; pen.beginPath();
    for (let k = 0; k < data.frames; k++) { const t = (k / (data.frames - 1)) * data.duration; pen.lineTo(faceOf(body, 0, t) + (right ? icon : 0), timeY(t)); }
    pen.stroke();
  }
  const faces = data.contacts.map((contact) => { const long = [contact.left, contact.right].filter(([name]) => byName[name].length), side = long.find(([name]) => byName[name].kind === "beam") || long[0]; return side ? placeX(byName[side[0]], side[1]) : placeX(byName[contact.right[0]], 0) + apart(byName[contact.right[0]]); }); // of two masses the face of the right one, beyond its gap at t = 0
  pen.strokeStyle = accent; pen.lineWidth = 3;
  for (const [contact, start, end] of film.spans) { pen.beginPath(); pen.moveTo(faces[contact], timeY(start)); pen.lineTo(faces[contact], Math.min(timeY(end), timeY(start) - 1)); pen.stroke(); }
  for (const [contact, time, kind] of film.events) {
    const [x, y] = [faces[contact], timeY(time)];
    pen.beginPath(); pen.lineWidth = 1.5; pen.strokeStyle = ink;
    if (kind === "impulse") { pen.moveTo(x - 5, y); pen.lineTo(x + 5, y); } else { pen.arc(x, y, 4, 0, 7); pen.fillStyle = kind === "close" ? ink : paper; pen.fill(); }
    pen.stroke();
  }
  pen.fillStyle = ink; pen.strokeStyle = muted; pen.lineWidth = 1; pen.textAlign = "right"; pen.textBaseline = "middle";
  for (const tick of ticks(0, data.duration / clock.size, 8)) { const y = timeY(tick * clock.size); pen.beginPath(); pen.moveTo(PAD.left - 4, y); pen.lineTo(PAD.left, y); pen.stroke(); pen.fillText(short(tick), PAD.left - 8, y); }
  pen.beginPath(); pen.moveTo(PAD.left, top); pen.lineTo(PAD.left, bottom); pen.stroke();
  const unit = scaled("m", whole), long = data.bodies.filter((body) => body.length);
  pen.textAlign = "center"; pen.textBaseline = "top";
  let last = -Infinity;
  for (const tick of ticks(0, whole / unit.size, Math.max(2, width / 110))) {
    const body = long.find((each) => each.x <= tick * unit.size * 1.000001 + 1e-12 && tick * unit.size <= (each.x + each.length) * 1.000001);
    if (!body) continue;
    const x = placeX(body, tick * unit.size - body.x);
    if (x < last + 34) continue;
    last = x;
    pen.beginPath(); pen.moveTo(x, bottom); pen.lineTo(x, bottom + 4); pen.stroke(); pen.fillText(short(tick), x, bottom + 7);
  }
  pen.fillText(long.length ? `place x [${unit.label}]` : "place", (PAD.left + width) / 2, bottom + 25);
  pen.save(); pen.translate(13, (top + bottom) / 2); pen.rotate(-Math.PI / 2); pen.fillText(`time t [${clock.label}]`, 0, -6); pen.restore();
  pen.textBaseline = "alphabetic";
}
function drawLegend() {
  $("ramps").replaceChildren(...Object.entries(limits).map(([unit, limit]) => {
    const item = document.createElement("span"), bar = document.createElement("i");
    const words = { Pa: ["tension", "compression"], m: ["down", "up"] }[unit] || ["", ""];
    bar.style.background = `linear-gradient(90deg, ${ramp.filter((_, i) => i % 16 === 0).map(rgb).join(",")}, ${rgb(ramp[254])})`;
    const more = data.films.some((film) => data.bodies.some((b) => b.unit === unit && film.bodies[b.name].largest > 1.001 * limit)) ? " and more" : "";
    item.append(`${words[0]} ${said(-limit, unit)}${more} `, bar, ` ${said(limit, unit)}${more} ${words[1]}`);
    return item;
  }));
}

// ---- time traces ----
const plots = [];
function readPanels(array) {
  const grid = Array.from({ length: data.points }, (_, i) => (i / (data.points - 1)) * data.duration / clock.size);
  for (const panel of data.panels) {
    const lines = panel.lines.map((each) => array(each.values));
    const largest = Math.max(...lines.map((values) => Math.max(...extremes(values).map(Math.abs))));
    const byReference = data.compared && panel.group !== "energy" && lines.length > 1 && data.methods[panel.lines.at(-1).method].colour === "ink";
    const size = scaled(panel.unit, byReference ? Math.max(...extremes(lines.at(-1)).map(Math.abs)) : largest);
    plots.push({ panel, size, byReference, largest, grid, lines: lines.map((values) => values.map((v) => v / size.size)) });
  }
}
const paint = (plot, k) => { const each = plot.panel.lines[k], method = data.methods[each.method]; return css(data.compared || method.colour === "ink" ? method.colour : `c${k % 9}`); };
function range(plot) { // of values: from the exact curve, so that spikes do not flatten all others
  return (u, low, high) => {
    if (plot.byReference && u.series.at(-1).show) [low, high] = extremes(plot.lines.at(-1));
    if (!(high > low)) return [low - 1, high + 1];
    const room = (plot.byReference ? 0.25 : 0.08) * (high - low);
    return [low - room, high + room];
  };
}
function makePlot(plot) {
  const box = document.createElement("div"), head = document.createElement("h3"), keys = document.createElement("div");
  box.className = "plot"; keys.className = "keys"; head.textContent = `${plot.panel.title} [${plot.size.label}]`;
  box.append(head, keys);
  $("plots").append(box);
  const axisLook = { stroke: () => css("ink"), grid: { stroke: () => css("line"), width: 1 }, ticks: { stroke: () => css("muted"), width: 1, size: 4 }, font: `12px ${css("sans")}`, labelFont: `12px ${css("sans")}` };
  const axes = [{ ...axisLook, size: 34, label: `time t [${clock.label}]`, labelSize: 18, values: (_, all) => all.map((v) => short(v)) }, { ...axisLook, size: 58, values: (_, all) => all.map((v) => short(v)) }];
  if (data.trip) axes.push({ ...axisLook, side: 0, scale: "x", size: 26, grid: { show: false }, splits: (u, i, low, high) => ticks((low * clock.size) / data.trip, (high * clock.size) / data.trip, Math.max(2, u.over.clientWidth / 90)).map((v) => (v * data.trip) / clock.size), values: (_, all) => all.map((v) => `${short((v * clock.size) / data.trip)} T`) });
  const series = plot.panel.lines.map((each, k) => ({ label: each.name, stroke: () => paint(plot, k), width: data.methods[each.method].colour !== "ink" ? (data.compared ? 1.5 : 2) : data.compared ? 2 : 1, dash: [undefined, [6, 3], [2, 2]][data.methods[each.method].dash], points: { show: false }, pxAlign: 0, show: !state.off.has(each.method) })); // not rounded to pixels: slow curves would be stairs
  const u = new uPlot({
    width: box.clientWidth, height: 210 + (data.trip ? 26 : 0), legend: { show: false }, series: [{}, ...series], axes,
    scales: { x: { time: false }, y: plot.panel.unit === "%" && plot.largest > MANY ? { distr: 4, asinh: 0.1, range: range(plot) } : { range: range(plot) } },
    cursor: { sync: { key: "time" }, drag: { x: true, y: false }, points: { show: false }, y: false },
    hooks: { setScale: [(self, key) => key === "x" && zoomAll(self)] },
  }, [plot.grid, ...plot.lines], box);
  u.root.setAttribute("role", "img");
  u.root.setAttribute("aria-label", `${plot.panel.title} over time: ${plot.panel.lines.map((each) => each.name).join(", ")}`);
  const cursor = document.createElement("div");
  cursor.className = "now"; u.over.append(cursor);
  let from = 0;
  u.over.addEventListener("mousedown", (event) => { from = event.clientX; });
  u.over.addEventListener("click", (event) => { if (Math.abs(event.clientX - from) < 4) setTime(u.posToVal(event.clientX - u.over.getBoundingClientRect().left, "x") * clock.size); });
  Object.assign(plot, { u, cursor, box, values: [] });
  if (!data.compared) plot.panel.lines.forEach((each, k) => keys.append(keyOf(each.name, () => paint(plot, k), (shown) => u.setSeries(k + 1, { show: shown }), plot.values)));
}
let zooming = false;
function zoomAll(from) {
  if (zooming || from.status !== 1) return;
  zooming = true;
  for (const { u } of plots) if (u && u !== from) u.setScale("x", { min: from.scales.x.min, max: from.scales.x.max });
  zooming = false;
  placeCursors();
}
function zoom(factor) { // about the cursor
  const { u } = plots[0], [low, high] = [u.scales.x.min, u.scales.x.max], end = data.duration / clock.size;
  const now = Math.min(Math.max(state.time / clock.size, low), high);
  const [min, max] = factor ? [Math.max(0, now + (low - now) * factor), Math.min(end, now + (high - now) * factor)] : [0, end];
  u.setScale("x", { min, max });
}
function setMethod(method, shown) {
  if (shown) state.off.delete(method); else state.off.add(method);
  for (const { u, panel } of plots) panel.lines.forEach((each, k) => { if (u && each.method === method) u.setSeries(k + 1, { show: shown }); });
}
function placeCursors() {
  for (const { u, cursor, values, lines, size, grid } of plots) {
    if (!u) continue;
    const x = u.valToPos(state.time / clock.size, "x");
    cursor.style.transform = `translateX(${x}px)`;
    cursor.hidden = !(x >= 0 && x <= u.over.clientWidth);
    if (values.length) { const i = Math.round((state.time / data.duration) * (grid.length - 1)); const step = 10 ** Math.floor(Math.log10(ROUNDING * Math.max(Math.abs(u.scales.y.min), Math.abs(u.scales.y.max)))); values.forEach((value, k) => { value.textContent = `${short(Math.round(lines[k][i] / step) * step, 3)} ${size.label}`; }); }
  }
}

// ---- one state, all views ----
const counted = []; // instants of the frames of the last second
function show() {
  const slider = $("time"), words = `${short(state.time / clock.size)} ${clock.label}`;
  slider.value = Math.round((state.time / data.duration) * slider.max);
  slider.setAttribute("aria-valuetext", words);
  $("clock").textContent = words;
  $("now").style.transform = `translateY(${timeY(state.time)}px)`;
  drawStage();
  placeCursors();
}
function setTime(time) { state.time = Math.min(Math.max(time, 0), data.duration); show(); }
let before = 0;
function step(now) {
  if (!state.playing) return;
  const next = state.time + ((now - before) / 1000) * Number($("speed").value) * data.duration / RUN_SECONDS;
  before = now;
  counted.push(now);
  while (counted[0] < now - 1000) counted.shift();
  setTime(next > data.duration ? 0 : next);
  requestAnimationFrame(step);
}
function play(on) {
  state.playing = on;
  $("play").textContent = on ? "Pause" : "Play";
  before = performance.now();
  counted.length = 0;
  if (on) requestAnimationFrame(step);
}
function layOut() {
  [ink, muted, paper, accent, line] = ["ink", "muted", "paper", "accent", "line"].map(css);
  stage = canvas($("stage"), STAGE); pen = stage.pen;
  view = project(stage.width);
  drawDiagram();
  for (const { u, box } of plots) if (u && u.width !== box.clientWidth) u.setSize({ width: box.clientWidth, height: u.height });
  show();
}
function stretchWords() { $("stretch").setAttribute("aria-valuetext", `times ${state.stretch}`); $("stretched").textContent = state.stretch === 1 ? "to scale" : `× ${state.stretch.toLocaleString("en")}`; }

// ---- start ----
async function start() {
  const array = await unpack(data.arrays);
  readFilms(array);
  readPanels(array);
  document.documentElement.classList.add("js");
  makeRamp(); measure(); stretchWords();
  $("stretch").max = STRETCHES.length - 1;
  $("stretch").value = STRETCHES.indexOf(state.stretch);
  const choice = $("method");
  data.methods.forEach((method, i) => choice.append(new Option(method.name, i, false, i === state.film)));
  choice.parentElement.hidden = data.methods.length < 2;
  if (data.compared) data.methods.forEach((method, i) => $("keys").append(keyOf(method.name, () => css(method.colour), (shown) => setMethod(i, shown))));
  drawLegend(); layOut();
  sortTables();
  $("play").addEventListener("click", () => play(!state.playing));
  $("time").addEventListener("input", (event) => setTime((event.target.value / event.target.max) * data.duration));
  choice.addEventListener("change", () => { state.film = Number(choice.value); layOut(); });
  $("stretch").addEventListener("input", (event) => { state.stretch = STRETCHES[event.target.value]; stretchWords(); layOut(); });
  for (const [id, factor] of [["closer", 0.5], ["wider", 2], ["all", 0]]) $(id).addEventListener("click", () => zoom(factor));
  $("figures").addEventListener("click", (event) => { const all = document.documentElement.classList.toggle("all"); event.target.setAttribute("aria-pressed", all); });
  document.addEventListener("keydown", (event) => { if (event.key === " " && !event.target.closest("button, input, select, summary, a")) { event.preventDefault(); play(!state.playing); } });
  const pick = (event) => { const box = $("diagram").getBoundingClientRect(); setTime(((timeY(0) - (event.clientY - box.top)) / (timeY(0) - timeY(data.duration))) * data.duration); };
  $("diagram").addEventListener("pointerdown", (event) => { $("diagram").setPointerCapture(event.pointerId); pick(event); });
  $("diagram").addEventListener("pointermove", (event) => { if (event.buttons) pick(event); });
  dark.addEventListener("change", () => { makeRamp(); drawLegend(); repaint.forEach((each) => each()); layOut(); plots.forEach(({ u }) => u && u.redraw()); });
  let width = innerWidth;
  addEventListener("resize", () => { if (innerWidth !== width) { width = innerWidth; layOut(); } });
  window.impactlab = {
    state, setTime, play, ready: performance.now(), ramp: () => ramp,
    spans: () => plots.map(({ u }) => [u.scales.x.min * clock.size, u.scales.x.max * clock.size]),
    fps: () => counted.length < 2 ? 0 : 1000 * (counted.length - 1) / (counted.at(-1) - counted[0]),
  };
}
async function drawPlots() { // one after the other, so that the page answers meanwhile
  for (const plot of plots) { makePlot(plot); await new Promise((done) => setTimeout(done)); placeCursors(); } // uPlot sets its scales after makePlot
  window.impactlab.drawn = performance.now();
}
start().then(drawPlots);
