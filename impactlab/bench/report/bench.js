// The live diagram of a bench: each run of a scene as a point, a line through the levels of each method, the front of
// those that are shown. One state: scene, axes, methods switched off, the run that is pointed at.

const SVG = "http://www.w3.org/2000/svg";
const MAX_ERROR = 2, MIN_FLOOR = 1e-9; // relative: runs beyond are counted, not drawn; the lowest end of an axis
const MAX_NAMED = 8, REACH = 28; // methods in colour; px around a run in which the pointer finds it
const COLOURS = [0, 1, 2, 3, 4, 5, 6, 8]; // of the palette; the one left out is near the grey of the others
const state = { scene: 0, up: 0, right: 0, off: new Set(), at: null };
let data, points = [], scale = null;

const SUPER = { "-": "⁻", 0: "⁰", 1: "¹", 2: "²", 3: "³", 4: "⁴", 5: "⁵", 6: "⁶", 7: "⁷", 8: "⁸", 9: "⁹" };
const power = (value) => `10${[...String(Math.round(Math.log10(value)))].map((sign) => SUPER[sign]).join("")}`;
const scene = () => data.scenes[state.scene];
const title = (each) => (each.variant === "base" ? each.case : `${each.case}/${each.variant}`);
const ranked = ({ m }) => !data.methods[m].stepless && typeof data.methods[m].shape === "number"; // of the grid, with steps
const isError = () => state.up < data.errors;
const milli = () => (data.sideways[state.right][1] === "s" ? 1e3 : 1);

function draw(name, attributes, parent, text) {
  const element = document.createElementNS(SVG, name);
  for (const [key, value] of Object.entries(attributes)) element.setAttribute(key, value);
  if (text !== undefined) element.textContent = text;
  parent.append(element);
  return element;
}
function readPoints() { // the runs of the scene that have both numbers and whose method is shown
  const { method, level, up, right } = scene();
  points = method.map((m, i) => ({ m, i, level: level[i], x: right[state.right][i] * milli(), y: up[state.up][i], special: data.methods[m].special }))
    .filter(({ m, i, x }) => x > 0 && up[state.up][i] !== null && !state.off.has(m));
}
function limits() { // whole decades around the methods with steps, as far as errors are errors
  const stepped = points.filter(ranked).map(({ y }) => y);
  const known = stepped.filter((y) => y > MIN_FLOOR && (!isError() || y < MAX_ERROR));
  if (!known.length) known.push(1e-3);
  const floor = Math.max(MIN_FLOOR, 10 ** Math.floor(Math.log10(Math.min(...known) / 1.5)));
  const top = 10 ** Math.ceil(Math.log10(Math.max(...known)) + 0.05);
  return [floor, isError() ? Math.min(MAX_ERROR, top) : top];
}
function frontOf(shown) { // no other run with steps is better in both; three digits count
  const front = [];
  for (const point of shown.filter(ranked).sort((a, b) => a.x - b.x || a.y - b.y)) {
    if (!front.length || point.y < front.at(-1).y) front.push(point);
  }
  return front;
}
function coloursOf(front) { // method -> colour: leaders by their own, or a free one where two would share it
  const found = new Map();
  for (const { m } of front) {
    if (found.has(m) || found.size >= MAX_NAMED) continue;
    const own = data.methods[m].colour, taken = new Set(found.values());
    const free = COLOURS.find((colour) => !taken.has(`var(--c${colour})`));
    found.set(m, own === null ? "var(--ink)" : `var(--c${taken.has(`var(--c${own})`) && free !== undefined ? free : own})`);
  }
  for (const { m } of points) if (data.methods[m].stepless || data.methods[m].shape === "*") found.set(m, "var(--ink)");
  return found;
}
function mark(parent, shape, x, y, size, colour) {
  const strokes = { x: `M${x - 3} ${y - 3}l6 6m0 -6l-6 6`, "*": `M${x - 5} ${y}h10M${x} ${y - 5}v10M${x - 3.5} ${y - 3.5}l7 7m0 -7l-7 7` };
  if (strokes[shape]) return draw("path", { d: strokes[shape], stroke: colour, fill: "none", "stroke-width": 1.3 }, parent);
  const s = size, paths = [`M${x - s} ${y}a${s} ${s} 0 1 0 ${2 * s} 0a${s} ${s} 0 1 0 ${-2 * s} 0z`, `M${x - s} ${y - s}h${2 * s}v${2 * s}h${-2 * s}z`, `M${x} ${y - 1.2 * s}l${1.2 * s} ${2.2 * s}h${-2.4 * s}z`, `M${x} ${y - 1.3 * s}l${1.3 * s} ${1.3 * s}l${-1.3 * s} ${1.3 * s}l${-1.3 * s} ${-1.3 * s}z`];
  return draw("path", { d: paths[shape] || paths[0], fill: colour }, parent);
}

function drawDiagram() {
  readPoints();
  const svg = $("diagram"), width = svg.parentElement.clientWidth, height = Math.round(Math.min(520, Math.max(380, 0.62 * width)));
  svg.replaceChildren();
  svg.setAttribute("viewBox", `0 0 ${width} ${height}`);
  svg.style.height = `${height}px`;
  const [floor, top] = limits(), over = points.filter(({ y }) => y > top).length;
  points = points.filter(({ y }) => y <= top);
  const wide = width > 640, front = frontOf(points), colours = coloursOf(front);
  const xs = points.map(({ x }) => x), low = Math.min(...xs), high = Math.max(...xs), room = (2 * high / low) ** 0.04;
  const box = { left: 58, right: width - (wide ? 190 : 12), top: 12, bottom: height - 46 };
  const [from, to] = points.length ? [low / room, high * room] : [1, 10];
  const px = (x) => box.left + (box.right - box.left) * Math.log(x / from) / Math.log(to / from);
  const py = (y) => box.bottom - (box.bottom - box.top) * Math.log(Math.max(y, floor) / (floor / 1.5)) / Math.log(top / (floor / 1.5));
  scale = { box };
  const text = (x, y, words, more = {}) => draw("text", { x, y, ...more }, svg, words);
  for (let decade = Math.round(Math.log10(floor)); 10 ** decade <= top * 1.0001; decade++) {
    draw("line", { class: "grid", x1: box.left, x2: box.right, y1: py(10 ** decade), y2: py(10 ** decade) }, svg);
    text(box.left - 7, py(10 ** decade) + 4, power(10 ** decade), { "text-anchor": "end" });
  }
  let last = -Infinity;
  for (let decade = Math.floor(Math.log10(from)); 10 ** decade <= to; decade++) {
    for (const value of (high / low < 300 ? [1, 2, 5] : [1]).map((lead) => lead * 10 ** decade)) {
      if (value < from || value > to || px(value) < last + 30) continue;
      last = px(value);
      draw("line", { class: "grid", x1: last, x2: last, y1: box.top, y2: box.bottom }, svg);
      text(last, box.bottom + 17, short(value), { "text-anchor": "middle" });
    }
  }
  const uncertain = scene().uncertainty;
  if (isError() && uncertain > floor) {
    draw("rect", { class: "unsure", x: box.left, y: py(uncertain), width: box.right - box.left, height: Math.max(0, box.bottom - py(uncertain)) }, svg);
    text(box.left + 6, py(uncertain) + 14, "below the uncertainty of the reference", { class: "quiet" });
  }
  draw("path", { class: "axes", d: `M${box.left} ${box.top}V${box.bottom}H${box.right}` }, svg);
  const [name, unit] = data.sideways[state.right];
  text((box.left + box.right) / 2, height - 8, name + (unit ? "  [ms]" : ""), { "text-anchor": "middle" });
  text(0, 0, data.upwards[state.up][1], { "text-anchor": "middle", transform: `translate(13 ${(box.top + box.bottom) / 2}) rotate(-90)` });
  for (const point of points) Object.assign(point, { left: px(point.x), up: py(point.y) });
  if (front.length) {
    const steps = front.map(({ left, up }) => `H${left.toFixed(1)}V${up.toFixed(1)}`).join("");
    draw("path", { class: "front", d: `M${front[0].left.toFixed(1)} ${box.top}${steps}H${box.right}` }, svg);
  }
  const lines = points.reduce((all, run) => all.set(run.m, [...(all.get(run.m) || []), run]), new Map());
  const ends = [];
  for (const [m, line] of [...lines].sort(([a], [b]) => colours.has(a) - colours.has(b))) {
    const method = data.methods[m], colour = colours.get(m) || "var(--edge)", named = colours.has(m);
    const group = draw("g", { class: named ? "named" : "other", "data-method": m }, svg);
    const own = method.shape === "x" || method.shape === "*" || method.stepless;
    if (!own && line.length > 1) draw("path", { d: `M${line.map(({ left, up }) => `${left.toFixed(1)} ${up.toFixed(1)}`).join("L")}`, fill: "none", stroke: colour, "stroke-width": named ? 2 : 0.9, "stroke-dasharray": method.special ? "5 3" : "none" }, group);
    for (const { left, up } of line) mark(group, method.stepless ? 3 : method.shape, left, up, named ? 3.6 : 2, colour);
    const best = line.reduce((a, b) => (b.y < a.y ? b : a));
    if (named) ends.push({ name: method.name, colour, left: best.left, up: best.up });
  }
  for (const { left, up } of front) draw("circle", { class: "ring", cx: left, cy: up, r: 6.5 }, svg);
  if (wide) writeNames(svg, ends, box);
  draw("circle", { id: "ring", r: 9, hidden: "" }, svg);
  if (!points.length) text((box.left + box.right) / 2, height / 2, state.off.size ? "no method shown has these numbers" : "no run has these numbers", { "text-anchor": "middle", class: "quiet" });
  $("count").textContent = `${title(scene())}: ${points.length} runs.${over ? ` ${over} with errors above ${100 * top} % are not drawn.` : ""}`;
  svg.setAttribute("aria-label", `${data.upwards[state.up][0]} against ${name} on ${title(scene())}. Arrow keys go from run to run.`);
  for (const key of $("keys").children) key.firstChild.style.background = colours.get(Number(key.dataset.method)) || "var(--edge)";
  if (state.at) point(points.find(({ i }) => i === state.at.i) || null);
}
function writeNames(svg, ends, box) { // in a column at the right, apart, each with a thin line to its own
  ends.sort((a, b) => a.up - b.up);
  const apart = Math.min(15, (box.bottom - box.top) / Math.max(1, ends.length));
  let below = box.top - apart;
  for (const end of ends) below = end.at = Math.max(end.up, below + apart);
  for (let i = ends.length - 1, limit = box.bottom + 4; i >= 0; i--) { ends[i].at = Math.min(ends[i].at, limit); limit = ends[i].at - apart; }
  for (const { name, colour, left, up, at } of ends) {
    draw("path", { d: `M${left} ${up}L${box.right + 12} ${at}`, stroke: colour, "stroke-width": 0.9, opacity: 0.8 }, svg);
    draw("text", { x: box.right + 15, y: at + 4 }, svg, name.length > 26 ? `${name.slice(0, 25)}…` : name);
  }
}

// ---- the run that is pointed at ----
function point(run) {
  state.at = run;
  const tip = $("tip"), ring = $("ring");
  tip.hidden = !run;
  ring.toggleAttribute("hidden", !run);
  for (const group of document.querySelectorAll("#diagram g")) group.classList.toggle("lit", Boolean(run) && Number(group.dataset.method) === run.m);
  if (!run) return;
  ring.setAttribute("cx", run.left); ring.setAttribute("cy", run.up);
  const { up, right } = scene(), name = document.createElement("b");
  name.textContent = data.methods[run.m].name + (run.level === "" ? "" : `, level ${run.level}`);
  const rows = [title(scene())];
  if (isError()) rows.push(`error of ${data.upwards[state.up][0]}: ${short(up[state.up][run.i])}`); else rows.push(`${data.upwards[state.up][0]}: ${short(up[state.up][run.i])}`);
  data.sideways.forEach(([what, unit], k) => { const value = right[k][run.i]; if (value !== null) rows.push(`${what}: ${unit ? said(value, unit) : short(value, 6)}`); });
  tip.replaceChildren(name, ...rows.map((words) => Object.assign(document.createElement("span"), { textContent: words })));
  const room = tip.parentElement.clientWidth - tip.offsetWidth;
  tip.style.left = `${Math.max(0, Math.min(room, run.left + (run.left > room ? -tip.offsetWidth - 14 : 14)))}px`;
  tip.style.top = `${Math.max(0, run.up - tip.offsetHeight - 12)}px`;
}
function nearest(event) {
  const box = $("diagram").getBoundingClientRect(), [x, y] = [event.clientX - box.left, event.clientY - box.top];
  const away = (run) => Math.hypot(run.left - x, run.up - y);
  const found = points.reduce((best, run) => (best && away(best) <= away(run) ? best : run), null);
  return found && away(found) < REACH ? found : null;
}
function walk(key) { // along the levels of a method, or from method to method
  if (!points.length) return;
  if (!state.at) { point(points[0]); return; }
  const methods = [...new Set(points.map(({ m }) => m))], own = points.filter(({ m }) => m === state.at.m);
  const step = key === "ArrowRight" || key === "ArrowDown" ? 1 : -1;
  if (key === "ArrowLeft" || key === "ArrowRight") { point(own[(own.indexOf(state.at) + step + own.length) % own.length]); return; }
  const next = methods[(methods.indexOf(state.at.m) + step + methods.length) % methods.length];
  point(points.find(({ m }) => m === next));
}

// ---- choices ----
function choose(number) {
  state.scene = number; state.at = null;
  const { case: chosen, slug } = scene(), variants = [...data.scenes.keys()].filter((k) => data.scenes[k].case === chosen);
  $("case").value = chosen;
  $("variant").replaceChildren(...variants.map((k) => new Option(data.scenes[k].variant, k, false, k === number)));
  $("variant").parentElement.hidden = variants.length < 2;
  for (const section of document.querySelectorAll(".scene")) section.classList.toggle("chosen", section.id === slug);
  makeKeys();
  drawDiagram();
  point(null);
}
function makeKeys() {
  const present = new Set(scene().method);
  $("keys").replaceChildren(...data.methods.flatMap((method, m) => {
    if (!present.has(m)) return [];
    const key = keyOf(method.name, () => "var(--edge)", (shown) => { if (shown) state.off.delete(m); else state.off.add(m); drawDiagram(); });
    key.dataset.method = m;
    key.setAttribute("aria-pressed", !state.off.has(m));
    return [key];
  }));
}
function switchTo(kept) { // the methods that stay on
  state.off = new Set([...data.methods.keys()].filter((m) => !kept(m)));
  for (const key of $("keys").children) key.setAttribute("aria-pressed", !state.off.has(Number(key.dataset.method)));
  drawDiagram();
}
function fromAddress(moved) {
  const number = data.scenes.findIndex(({ slug }) => `#${slug}` === decodeURIComponent(location.hash));
  if (number < 0) return false;
  choose(number);
  if (moved) $("see").scrollIntoView();
  return true;
}
async function start() {
  data = JSON.parse(new TextDecoder().decode(await inflated($("data").textContent)));
  document.documentElement.classList.add("js");
  const known = (k) => data.scenes.some(({ right }) => right[k].some((value) => value > 0));
  state.right = Math.max(0, data.sideways.findIndex((_, k) => known(k))); // steps, of a table without times
  $("case").append(...[...new Set(data.scenes.map((each) => each.case))].map((name) => new Option(name)));
  $("up").append(...data.upwards.map(([name], k) => new Option(name, k)));
  $("right").append(...data.sideways.map(([name], k) => new Option(name, k)));
  $("right").value = state.right;
  $("case").addEventListener("change", (event) => choose(data.scenes.findIndex((each) => each.case === event.target.value)));
  $("variant").addEventListener("change", (event) => choose(Number(event.target.value)));
  for (const axis of ["up", "right"]) $(axis).addEventListener("change", (event) => { state[axis] = Number(event.target.value); drawDiagram(); });
  $("every").addEventListener("click", () => switchTo(() => true));
  $("none").addEventListener("click", () => switchTo(() => false));
  $("front").addEventListener("click", () => { const kept = new Set(frontOf(points).map(({ m }) => m)); switchTo((m) => kept.has(m)); });
  const svg = $("diagram");
  svg.addEventListener("pointermove", (event) => point(nearest(event)));
  svg.addEventListener("pointerdown", (event) => point(nearest(event)));
  svg.addEventListener("pointerleave", () => point(null));
  svg.addEventListener("keydown", (event) => {
    if (event.key.startsWith("Arrow")) { event.preventDefault(); walk(event.key); }
    if (event.key === "Escape") point(null);
  });
  svg.addEventListener("blur", () => point(null));
  $("keys").addEventListener("pointerover", (event) => { const key = event.target.closest(".key"), run = key && points.find(({ m }) => m === Number(key.dataset.method)); if (run) point(run); });
  addEventListener("hashchange", () => fromAddress(true));
  let width = innerWidth;
  addEventListener("resize", () => { if (innerWidth !== width) { width = innerWidth; drawDiagram(); } });
  if (!fromAddress(false)) choose(0);
  sortTables();
  window.impactlab = { state, points: () => points, drawn: performance.now() };
}
start();
