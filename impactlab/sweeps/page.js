"use strict";
// The page of a sweep: a point is chosen by a click in a figure or by a slider for each axis; its values follow.

const data = JSON.parse(document.getElementById("data").textContent);
const $ = (id) => document.getElementById(id);
const sizes = data.listed ? [data.points] : data.axes.map((axis) => axis.shown.length);
const state = { at: sizes.map((size) => Math.floor((size - 1) / 2)) };
let table;

async function unpack(text) { // as impactlab/sweeps/page.py packs it
  const bytes = Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0));
  const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("deflate"));
  const planes = new Uint8Array(await new Response(stream).arrayBuffer());
  const count = planes.length / 4, whole = new DataView(new ArrayBuffer(planes.length));
  for (let plane = 0; plane < 4; plane++) for (let i = 0; i < count; i++) whole.setUint8(4 * i + plane, planes[plane * count + i]);
  return (column, point) => whole.getFloat32(4 * (column * data.points + point), true);
}

const PREFIXES = [[1e9, "G"], [1e6, "M"], [1e3, "k"], [1, ""], [1e-3, "m"], [1e-6, "µ"], [1e-9, "n"]];
function said(value, unit) {
  if (!Number.isFinite(value)) return "–";
  const plain = !unit || unit.startsWith("kg") || unit.startsWith("s/") || /[234²³⁴^*]/.test(unit);
  const [size, prefix] = (!plain && PREFIXES.find(([size]) => Math.abs(value) >= 0.9999 * size)) || [1, ""];
  return `${String(Number((value / size).toPrecision(6))).replace("-", "\u2212")}${unit ? `\u00a0${prefix}${unit}` : ""}`;
}
const pointNumber = () => state.at.reduce((number, at, axis) => number * sizes[axis] + at, 0);
const placeOn = (axis) => (data.listed ? state.at[0] : state.at[axis]);

function show() {
  const point = pointNumber(), status = data.statuses[table(0, point)];
  const count = data.points.toLocaleString("en");
  $("number").textContent = `Point ${(point + 1).toLocaleString("en")} of ${count}: ${status.replaceAll("_", " ")}`;
  document.querySelectorAll("#axes output").forEach((output, axis) => { output.textContent = data.axes[axis].shown[placeOn(axis)]; });
  document.querySelectorAll("#axes input").forEach((slider, axis) => {
    slider.value = state.at[axis];
    slider.setAttribute("aria-valuetext", data.listed ? `point ${point + 1}` : data.axes[axis].shown[state.at[axis]]);
  });
  $("reason").textContent = data.reasons[table(1, point)];
  $("values").replaceChildren(...data.quantities.map(({ name, label, unit }, number) => {
    const item = document.createElement("li"), head = document.createElement("span"), value = document.createElement("b");
    head.textContent = `${name.replaceAll("_", " ")}${label ? ` ${label}` : ""}`;
    value.textContent = said(table(2 + number, point), unit);
    item.append(head, value);
    return item;
  }));
  $("command").textContent = [data.again, ...data.axes.map((axis, i) => axis.sets[placeOn(i)])].join(" ");
  $("copy").textContent = "Copy";
  document.querySelectorAll(".mark").forEach(mark);
}
function mark(box) {
  const [x, y] = data.axes.map((axis, i) => axis.along[state.at[i]]);
  const parts = [["i", "x", "left", x]];
  if (y !== undefined) parts.push(["i", "y", "top", 1 - y], ["b", "", "", 0]);
  box.replaceChildren(...parts.map(([kind, name, side, share]) => {
    const part = document.createElement(kind);
    if (name) { part.className = name; part.style[side] = `${100 * share}%`; }
    else { part.style.left = `${100 * x}%`; part.style.top = `${100 * (1 - y)}%`; }
    return part;
  }));
}
function nearest(along, share) {
  return along.reduce((best, each, i) => (Math.abs(each - share) < Math.abs(along[best] - share) ? i : best), 0);
}
function choose(event) { // the point nearest to a click in a panel
  for (const box of event.currentTarget.querySelectorAll(".mark")) {
    const { left, top, width, height } = box.getBoundingClientRect();
    const x = (event.clientX - left) / width, y = 1 - (event.clientY - top) / height;
    if (x < 0 || x > 1 || y < 0 || y > 1) continue;
    state.at = data.axes.map((axis, i) => nearest(axis.along, [x, y][i]));
    show();
  }
}
function controls() { // a slider for each axis; of listed points one for all
  data.axes.forEach((axis, i) => {
    const label = document.createElement("label"), output = document.createElement("output");
    label.textContent = axis.path;
    const slides = !data.listed || i === 0, slider = document.createElement("input");
    Object.assign(slider, { type: "range", min: 0, max: sizes[i] - 1, step: 1, id: `axis-${i}` });
    if (slides) {
      label.htmlFor = slider.id;
      slider.addEventListener("input", () => { state.at[i] = Number(slider.value); show(); });
    }
    $("axes").append(label, output, slides ? slider : document.createElement("span"));
  });
}
async function copy() {
  const text = $("command").textContent;
  try { await navigator.clipboard.writeText(text); }
  catch { // a page that is opened as a file may not write to the clipboard
    getSelection().selectAllChildren($("command"));
    document.execCommand("copy");
  }
  $("copy").textContent = "Copied";
}
async function start() {
  table = await unpack(data.table);
  controls();
  document.documentElement.classList.add("js");
  document.querySelectorAll(".frame").forEach((frame) => frame.addEventListener("click", choose));
  $("copy").addEventListener("click", copy);
  show();
  window.impactlab = { state, drawn: performance.now() };
}
start();
