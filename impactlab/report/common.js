// Shared by the live pages: elements, colours, numbers, packed data, keys of a legend.

const $ = (id) => document.getElementById(id);
const css = (name) => getComputedStyle(document.documentElement).getPropertyValue(`--${name}`).trim();
const dark = matchMedia("(prefers-color-scheme: dark)");

// ---- numbers ----
const PREFIXES = [[1e9, "G"], [1e6, "M"], [1e3, "k"], [1, ""], [1e-3, "m"], [1e-6, "µ"], [1e-9, "n"]];
function scaled(unit, largest) {
  if (unit === "%" || !(largest > 0)) return { size: 1, label: unit };
  const [size, prefix] = PREFIXES.find(([size]) => largest >= 0.9999 * size) || [1e-9, "n"];
  return { size, label: unit === "strain" ? (prefix ? `${prefix}ε` : "strain") : prefix + unit };
}
const minus = (text) => text.replace("-", "\u2212");
const short = (value, digits = 4) => (value == null ? "" : minus(String(Number(value.toPrecision(digits)))));
function said(value, unit) {
  const shown = scaled(unit, Math.abs(value));
  return `${short(value / shown.size)}\u00a0${shown.label}`;
}

// ---- data ----
async function inflated(text) { // base64 of deflated bytes
  const bytes = Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0));
  const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("deflate"));
  return new Uint8Array(await new Response(stream).arrayBuffer());
}

// ---- the legend ----
const repaint = []; // called where the colour scheme changes
function keyOf(name, stroke, toggle, values) {
  const button = document.createElement("button"), swatch = document.createElement("i"), value = document.createElement("output");
  button.type = "button"; button.className = "key"; button.setAttribute("aria-pressed", "true");
  swatch.style.background = stroke(); repaint.push(() => { swatch.style.background = stroke(); });
  button.append(swatch, name);
  if (values) { value.setAttribute("aria-live", "off"); button.append(value); values.push(value); }
  button.addEventListener("click", () => { const shown = button.getAttribute("aria-pressed") !== "true"; button.setAttribute("aria-pressed", shown); toggle(shown); });
  return button;
}
