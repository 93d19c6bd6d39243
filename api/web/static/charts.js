// Charts in the colours of the page: light or dark, as the system asks, and again when it changes.

const dark = matchMedia("screen and (prefers-color-scheme: dark)"); // paper is always light
export const calm = matchMedia("(prefers-reduced-motion: reduce)");
const drawn = new Map(); // node -> how to draw it again
const resized = new ResizeObserver((sizes) => sizes.forEach(({ target }) => drawn.get(target)()));

function colours() {
  const style = getComputedStyle(document.documentElement);
  const of = (name) => style.getPropertyValue(name).trim();
  return { ink: of("--ink"), soft: of("--soft"), line: of("--line"), paper: of("--paper"),
    series: Array.from({ length: 8 }, (_, k) => of(`--series-${k + 1}`)) };
}

let theme = colours();

export function colour(place) {
  return theme.series[Math.max(place, 0) % theme.series.length];
}

// The same for a stylesheet, which follows the page's colours itself.
export const colourName = (place) => place < 0 ? "transparent" : `var(--series-${(place % theme.series.length) + 1})`;

export const ink = () => theme.ink;

// traces(): Plotly traces, made anew with the colours of the moment. `kept`: zoom stays as long as it is the same.
export function chart(node, { title, x, y, kept, traces, words }) {
  const again = () => {
    const { clientWidth: width, clientHeight: height } = node;
    if (!width) return; // out of sight: drawn when it is shown
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

dark.addEventListener("change", () => {
  theme = colours();
  for (const again of drawn.values()) again();
});
