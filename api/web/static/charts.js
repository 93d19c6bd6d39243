// Charts in the colours of the page: light or dark, as the system asks, and again when it changes.

const dark = matchMedia("screen and (prefers-color-scheme: dark)"); // paper is always light
export const calm = matchMedia("(prefers-reduced-motion: reduce)");
const PAPER = { width: 660, height: 270 }; // px: A4 and Letter are wider, and paper cannot be measured before it is printed
let onPaper = false;
const drawn = new Map(); // node -> how to draw it again
const resized = new ResizeObserver((sizes) => sizes.forEach(({ target }) => drawn.get(target)()));

function colours() {
  const style = getComputedStyle(document.documentElement);
  const of = (name) => style.getPropertyValue(name).trim();
  return { ink: of("--ink"), soft: of("--soft"), line: of("--line"), paper: of("--paper"),
    series: Array.from({ length: 8 }, (_, k) => of(`--series-${k + 1}`)) };
}

let theme = colours();

// Lengths of line and gap in px. Each place has a colour and a pattern, so that nobody needs to see colours.
const PATTERNS = [[1, 0], [10, 4], [2, 3], [10, 3, 2, 3], [18, 5]];
const patternOf = (place) => PATTERNS[place % PATTERNS.length];

export function lineOf(place, width) {
  const seen = Math.max(place, 0);
  return { width, color: theme.series[seen % theme.series.length], dash: seen % PATTERNS.length ? patternOf(seen).map((px) => px + "px").join() : "solid" };
}

// The same as the background of a swatch, which follows the page's colours itself.
export function swatchOf(place) {
  if (place < 0) return "none";
  const colour = `var(--series-${(place % theme.series.length) + 1})`;
  let end = 0;
  const stops = patternOf(place).map((px, k) => `${k % 2 ? "transparent" : colour} ${end}px ${end += px}px`);
  return `repeating-linear-gradient(90deg, ${stops.join(", ")})`;
}

export const ink = () => theme.ink;

// traces(): Plotly traces, made anew with the colours of the moment. `kept`: zoom stays as long as it is the same.
export function chart(node, { title, x, y, kept, traces, words }) {
  const again = () => {
    if (!node.clientWidth) return; // out of sight: drawn when it is shown
    const { width, height } = onPaper ? PAPER : { width: node.clientWidth, height: node.clientHeight };
    const axis = { zeroline: true, zerolinecolor: theme.soft, gridcolor: theme.line, linecolor: theme.line, automargin: true };
    Plotly.react(node, traces(), {
      width, height,
      title: { text: title, font: { size: 14 }, x: 0, xref: "paper", xanchor: "left" },
      margin: { l: 56, r: 8, t: 34, b: 42 }, showlegend: false,
      paper_bgcolor: theme.paper, plot_bgcolor: theme.paper,
      font: { family: "system-ui, sans-serif", color: theme.ink, size: 12 },
      xaxis: { ...axis, title: { text: x } }, yaxis: { ...axis, title: { text: y } }, uirevision: kept,
      hovermode: "closest",
    }, { displayModeBar: false, doubleClick: "reset" });
  };
  if (!drawn.has(node)) resized.observe(node);
  drawn.set(node, again);
  node.setAttribute("role", "img");
  node.setAttribute("aria-label", words);
  again();
}

// The largest force decides the unit, as a person would.
export function forceScale(peak) {
  return peak >= 1000 ? [1e-3, "kN"] : [1, "N"];
}

export const scaled = (values, factor) => values.map((value) => value === null ? null : value * factor);

export function peakOf(values) {
  return values.reduce((most, value) => Math.max(most, Math.abs(value ?? 0)), 0);
}

function drawAll() {
  for (const again of drawn.values()) again();
}

dark.addEventListener("change", () => {
  theme = colours();
  drawAll();
});

for (const [name, paper] of [["beforeprint", true], ["afterprint", false]]) {
  addEventListener(name, () => {
    onPaper = paper;
    drawAll();
  });
}
